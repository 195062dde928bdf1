// Haptic device of a run, set once for all responses (METHODS §8).
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "contact/tip_force.hpp"
#include "method/entry.hpp"

namespace trocar {

/// Settings of the device, as parameters.
const std::vector<Parameter>& device_parameters();

/// Parses e.g. "tip=sum,saturation=3"; missing settings get their default. Throws InputError on malformed text, an
/// unknown key or a value out of range.
TipSettings read_device(std::string_view text);
/// The same from parsed settings.
TipSettings read_device(const std::map<std::string, std::string>& given);

/// All settings as read_device reads them, in the order of device_parameters().
std::string text_of(const TipSettings& device);

}  // namespace trocar
