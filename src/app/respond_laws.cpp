#include "app/respond_laws.hpp"

#include <algorithm>
#include <array>

#include "app/respond_input.hpp"

namespace trocar::app {
namespace {

constexpr std::array families{"3.4",    "3.5", "3.6",     "3.8",  "3.9",    "3.11",      "3.17",
                              "static", "osc", "preload", "stab", "wrench", "distribute"};

}  // namespace

bool known_family(const std::string& family) {
    return std::find(families.begin(), families.end(), family) != families.end();
}

LawAnswer answer_case(const std::string& family, const Json& json, const Json& expected, const std::string& file,
                      const std::string& pointer) {
    const trocar::Json values = json;
    const CaseInput input(values, file, pointer);
    if (family == "3.4") return vertex_in_instrument(input);
    if (family == "3.5" || family == "3.9") return edges_cross(input);
    if (family == "3.6") return instrument_in_tissue(input);
    if (family == "3.8") return input.has("neighbours") ? equilibrium(input) : projection(input, false);
    if (family == "3.11") return projection(input, true);
    if (family == "3.17") return tissue_exchange(input);
    if (family == "static") return input.has("k_tissue") ? springs_in_series(input) : mass_on_plane(input);
    if (family == "osc") return input.has("times") ? oscillation(input, expected) : oscillation_energy(input);
    if (family == "preload") return preloaded_pair(input);
    if (family == "stab") {
        if (input.has("N")) return chain_limits(input);
        return input.has("n") ? sheet_limits(input) : contact_limits(input);
    }
    if (family == "wrench") return wrench(input);
    return distribution(input);
}

}  // namespace trocar::app
