#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int mesh(const CommonOptions& /*common*/, const MeshOptions& /*options*/) {
    throw std::runtime_error("mesh is not built yet");
}

}  // namespace trocar::app
