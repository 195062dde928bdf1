// JUnit XML, the format in which CI servers read what passed and what failed.
#pragma once

#include <string>
#include <vector>

namespace trocar::app {

struct JUnitCase {
    enum class Result { passed, failed, skipped };
    std::string name;
    Result result = Result::passed;
    std::string type = {};     ///< of a failure
    std::string message = {};  ///< in one line
    std::string details = {};  ///< of a failure, lines after the message
};

struct JUnitSuite {
    std::string name;
    std::vector<JUnitCase> cases;
};

/// The document. Texts may hold any bytes; control characters and invalid UTF-8 are replaced.
std::string junit_text(const std::string& program, const std::vector<JUnitSuite>& suites);

}  // namespace trocar::app
