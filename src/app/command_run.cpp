#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int run(const CommonOptions& /*common*/, const RunOptions& /*options*/) {
    throw std::runtime_error("run is not built yet");
}

}  // namespace trocar::app
