#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int respond(const CommonOptions& /*common*/, const RespondOptions& /*options*/) {
    throw std::runtime_error("respond is not built yet");
}

}  // namespace trocar::app
