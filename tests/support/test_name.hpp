// Valid GoogleTest names from other names.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace trocar::test {

/// "ode_joints:setting=library" -> "ode_joints_setting_library": every other character becomes '_'.
inline std::string test_name(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char letter) { return std::isalnum(letter) == 0; }, '_');
    return text;
}

}  // namespace trocar::test
