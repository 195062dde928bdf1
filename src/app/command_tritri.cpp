#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int tritri(const CommonOptions& /*common*/, const TritriOptions& /*options*/) {
    throw std::runtime_error("tritri is not built yet");
}

}  // namespace trocar::app
