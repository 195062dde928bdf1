// Completion scripts for bash, zsh and fish, and the man page, generated from the parser.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace trocar::app {

/// `what`: "bash", "zsh", "fish" or "man".
std::string shell_words(const CLI::App& app, const std::string& what, const std::string& exit_status,
                        const std::string& version);

}  // namespace trocar::app
