// Registration of methods of another project, built against an installed trocar. The lines trocar_add_detector,
// trocar_add_response, trocar_add_contact_generator and trocar_add_stepper (src/method.cmake) generate its code.
#pragma once

#include <string>
#include <vector>

#include "method/registry.hpp"

namespace trocar {

/// A variable of this type adds methods before main begins. Throws std::logic_error after the first call of registry().
/// A name that another method has makes registry() throw InputError.
class OutsideMethod {
public:
    explicit OutsideMethod(void (*add)(Registry&));
};

/// Adds a method at any time, or replaces the one that was added here under this name. References to entries of its
/// kind become invalid, so that no run may be under way. Throws InputError when another method has the name.
void add_outside_method(DetectorEntry entry);
void add_outside_method(ResponseEntry entry);

/// Names in the order of registration, without absent methods.
const std::vector<std::string>& outside_methods();

}  // namespace trocar
