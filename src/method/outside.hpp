// Methods of a project of its own, which is built against an installed trocar: they join the registry beside trocar's.
// The lines trocar_add_detector, trocar_add_response, trocar_add_contact_generator and trocar_add_stepper
// (src/method.cmake) write the file that says so.
#pragma once

#include <string>
#include <vector>

#include "method/registry.hpp"

namespace trocar {

/// A variable of this type adds methods before main begins. Throws std::logic_error once the registry has been asked.
/// A name that another method has makes registry() throw InputError.
class OutsideMethod {
public:
    explicit OutsideMethod(void (*add)(Registry&));
};

/// Their names, in the order in which they joined; absent ones are not among them.
const std::vector<std::string>& outside_methods();

}  // namespace trocar
