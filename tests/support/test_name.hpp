// Names of tests that are made from other names: what GoogleTest takes in them.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace trocar::test {

/// "ode_joints:setting=library" as "ode_joints_setting_library": every character but letters and digits is '_'.
inline std::string test_name(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char letter) { return std::isalnum(letter) == 0; }, '_');
    return text;
}

}  // namespace trocar::test
