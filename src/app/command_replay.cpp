#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int replay(const CommonOptions& /*common*/, const ReplayOptions& /*options*/) {
    throw std::runtime_error("replay is not built yet");
}

}  // namespace trocar::app
