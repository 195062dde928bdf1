#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int schema(const CommonOptions& /*common*/, const SchemaOptions& /*options*/) {
    throw std::runtime_error("schema is not built yet");
}

}  // namespace trocar::app
