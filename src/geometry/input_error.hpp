// The only exception for bad user input (scene, study, mesh, command line). It is caught once, in main, and ends the
// program with exit status 2. Nothing else in trocar throws across an interface.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace trocar {

/// Text from a file as one line of valid UTF-8, safe for a terminal. Control characters and bytes that are not UTF-8
/// become \xNN. Beyond `longest` bytes the middle is left out, since messages start with the place and end with the
/// finding.
std::string printable_line(std::string_view text, std::size_t longest = 400);

/// One printable line: "file: where: expected X, got Y". `where` is a line number, a byte offset or a JSON pointer; may
/// be empty.
class InputError : public std::runtime_error {
public:
    InputError(std::string_view file, std::string_view where, std::string_view expected, std::string_view found)
        : std::runtime_error(printable_line(compose(file, where, expected, found))) {}
    /// For messages that do not fit "expected X, got Y".
    explicit InputError(const std::string& message) : std::runtime_error(printable_line(message)) {}

private:
    static std::string compose(std::string_view file, std::string_view where, std::string_view expected,
                               std::string_view found) {
        std::string text;
        for (std::string_view part : {file, where}) {
            if (!part.empty()) text.append(part).append(": ");
        }
        return text.append("expected ").append(expected).append(", got ").append(found);
    }
};

}  // namespace trocar
