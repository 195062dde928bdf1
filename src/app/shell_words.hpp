// What a shell and a reader need of the command line, reported by the parser itself: completion scripts for bash, zsh
// and fish, and the man page. A command that joins the parser is in all of them.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace trocar::app {

/// The text for `what`: "bash", "zsh", "fish" or "man".
std::string shell_words(const CLI::App& app, const std::string& what, const std::string& exit_status,
                        const std::string& version);

}  // namespace trocar::app
