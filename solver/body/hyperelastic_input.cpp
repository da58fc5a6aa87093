#include "solver/body/hyperelastic_input.hpp"

#include "mesh/base/file.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/fibres.hpp"
#include "solver/solid/assembly.hpp"

#include <algorithm>
#include <filesystem>

namespace amontons {

Hyperelastic hyperelastic_of(const SolidInput& input, const std::string& file)
{
    Hyperelastic m;
    if (input.material.law.empty()) {
        m.law = find_law("neo_hooke");
        m.constants = {input.youngs_modulus, input.poisson_ratio};
    } else {
        m.law = find_law(input.material.law);
        m.constants = input.material.constants;
    }
    if (!m.law)
        throw InputError({{file, "/bodies/" + input.name + "/material/law",
                           quoted_text(input.material.law), "the name of a law"}});
    return m;
}

std::vector<HyperelasticElement> hyperelastic_elements(const SolidInput& input,
                                                       const Hyperelastic& law,
                                                       const VolumeMesh& mesh,
                                                       const std::string& file)
{
    std::vector<Vec3> fibres;
    if (law.law->directed && !input.material.fibres.empty()) {
        const std::string path =
            (std::filesystem::path(file).parent_path() / input.material.fibres).string();
        fibres = parse_fibres(read_file(path), path, element_count(mesh));
        for (Vec3& fibre : fibres)
            fibre = rotation(input.material.turned) * fibre;
    }
    std::vector<HyperelasticElement> elements;
    for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const Mat3 axes = !law.law->directed ? Mat3(Mat3::Identity())
                          : fibres.empty()   ? fibre_axes(input.material.fibre)
                                             : fibre_axes(fibres[std::size_t(e)]);
        elements.push_back(make_hyperelastic(kind, places_of(mesh, nodes), axes));
    });
    return elements;
}

} // namespace amontons
