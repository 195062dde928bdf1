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

/// Names in the order of registration, without absent methods.
const std::vector<std::string>& outside_methods();

}  // namespace trocar
