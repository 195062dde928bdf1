// What the contracts of steppers share: every registered stepper as it comes, and those that leave small tissue to
// another one once more where they step it themselves, so that the contract's samples are not the other one's.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "method/registry.hpp"
#include "support/test_name.hpp"

namespace trocar::test {

/// As on a command line.
inline std::vector<std::string> stepper_methods() {
    std::vector<std::string> methods;
    for (const StepperEntry& entry : registry().steppers()) {
        methods.push_back(entry.name);
        for (const Parameter& parameter : entry.parameters) {
            if (parameter.name == "whole") methods.push_back(entry.name + ":whole=0,tolerance=1e-13");
        }
    }
    return methods;
}

inline std::unique_ptr<Stepper> stepper_of(const std::string& method) { return make_stepper(method); }

}  // namespace trocar::test
