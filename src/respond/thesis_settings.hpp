// Settings of the response `thesis`: one of three profiles, and values that the thesis leaves open. `printed` is the
// literal thesis, `faithful` corrects the damper sign of 3.6, `corrected` all equations (METHODS §13).
#pragma once

#include <cstdint>
#include <vector>

#include "contact/response_output.hpp"
#include "method/entry.hpp"
#include "respond/contact_laws.hpp"

namespace trocar {

enum class Profile : std::uint8_t { printed, faithful, corrected };

struct ThesisSettings {
    Profile profile = Profile::faithful;
    bool distribute = true;  ///< §4.3.1: force distributed over the face; false: on the vertex, §3.4
    double n_back = 10.0;    ///< ticks; 0: no back-projection
    double l_max = 0.02;     ///< m
    LawSettings law;
    ContactTiming contact_timing = ContactTiming::implicit;
    [[nodiscard]] bool corrected() const { return profile == Profile::corrected; }
};

std::vector<Parameter> thesis_parameters();
ThesisSettings read_thesis_settings(const ParameterValues& values);

}  // namespace trocar
