#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int study(const CommonOptions& /*common*/, const StudyOptions& /*options*/) {
    throw std::runtime_error("study is not built yet");
}

}  // namespace trocar::app
