// The device of a run: what shows the force on an instrument, set once for all responses (METHODS §8).
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "contact/tip_force.hpp"
#include "method/entry.hpp"

namespace trocar {

/// Its settings, in the form of a method's parameters.
const std::vector<Parameter>& device_parameters();

/// "tip=sum,saturation=3"; what is not given, and an empty text, is the default. Throws InputError on a malformed text,
/// an unknown key or a value out of range.
TipSettings read_device(std::string_view text);
/// The same from settings that are taken apart already.
TipSettings read_device(const std::map<std::string, std::string>& given);

/// Every setting as read_device reads it, in the order of device_parameters().
std::string text_of(const TipSettings& device);

}  // namespace trocar
