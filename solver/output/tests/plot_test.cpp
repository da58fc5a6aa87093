#include "solver/output/plot.hpp"

#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <fstream>

using namespace amontons;

TEST_CASE("instruments that are driven separately have a curve each of push, torque and rotation")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "history.csv")
        << "step,time [s],depth [m],base_twist [rad],tip_rotation [rad],push_force [N],torque [N "
           "m],"
           "catheter_depth [m],catheter_base_twist [rad],catheter_tip_rotation [rad],"
           "catheter_push_force [N],catheter_torque [N m],work [J]\n"
           "0,0,0,0,0,0,0,0,0,0,0,0,0\n1,1,1,1,1,1,1,1,1,1,1,1,1\n2,2,2,2,2,2,2,2,2,2,2,2,2\n";
    std::string message;
    const std::vector<std::string> files = plot_history(folder.path().string(), message);
    const auto script = [&](const std::string& name) {
        CHECK(std::find(files.begin(), files.end(), name) != files.end());
        return read_file(folder / name);
    };
    CHECK(script("pushes.gp").find("'push of catheter'") != std::string::npos);
    CHECK(script("torques.gp").find("column('catheter_torque [N m]')*1000") != std::string::npos);
    const std::string turns = script("turns.gp");
    for (const char* title : {"'base'", "'tip'", "'base of catheter'", "'tip of catheter'"})
        CHECK(turns.find(title) != std::string::npos);
}
