#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int explain(const CommonOptions& /*common*/, const ExplainOptions& /*options*/) {
    throw std::runtime_error("explain is not built yet");
}

}  // namespace trocar::app
