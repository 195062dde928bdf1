#include <stdexcept>

#include "app/commands.hpp"

namespace trocar::app {

int report(const CommonOptions& /*common*/, const ReportOptions& /*options*/) {
    throw std::runtime_error("report is not built yet");
}

}  // namespace trocar::app
