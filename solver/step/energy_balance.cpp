#include "solver/step/energy_balance.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {

void follow(EnergyRecord& e)
{
    e.most_kinetic = std::max(e.most_kinetic, std::abs(e.kinetic - e.kinetic_start));
    e.most_elastic = std::max(e.most_elastic, std::abs(e.elastic - e.elastic_start));
}

double energy_fault(double error, const EnergyRecord& e, const EnergyScale& scale)
{
    const double floor =
        std::max(scale.accuracy * e.largest_force * scale.size, scale.round_off);
    return error > floor && e.scale() > 0 ? error / e.scale() : 0;
}

double energy_fault(const EnergyRecord& e, const EnergyScale& scale)
{
    const double error = scale.dynamic ? -e.error() : std::abs(e.error());
    return energy_fault(std::max(error, -e.released), e, scale);
}

std::string energy_warning(const EnergyRecord& e, const EnergyScale& scale)
{
    const double fault = energy_fault(e, scale);
    if (!(fault > kEnergyTold)) return "";
    if (-e.released >= (scale.dynamic ? -e.error() : std::abs(e.error())))
        return fmt::format(
            "the energy has grown by {:.3g} J without a cause, {:.2g} of what the run "
            "turned over; shorter steps gain less",
            -e.released, fault);
    return fmt::format(
        "{:.3g} J of energy {}, {:.2g} of what the run turned over: its steps, or jumps "
        "within them, miss as much of the work; shorter steps, or finer meshes where "
        "bodies slide, miss less",
        std::abs(e.error()), e.error() > 0 ? "were lost" : "came from nowhere", fault);
}

} // namespace amontons
