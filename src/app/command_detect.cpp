#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int detect(const CommonOptions& /*common*/, const DetectOptions& /*options*/) {
    throw std::runtime_error("detect is not built yet");
}

}  // namespace trocar::app
