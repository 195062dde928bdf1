// The one list of what the commands print with --json beyond the figures of a summary: path, unit, meaning. A test
// holds it against what they print.
#pragma once

#include <span>

namespace trocar::app {

struct OutputKey {
    const char* command;
    const char* key;  ///< path in the document; [] = each element, * = any name
    const char* unit;
    const char* meaning;  ///< with frame, sign and when the value is null
};

[[nodiscard]] std::span<const OutputKey> output_keys();

}  // namespace trocar::app
