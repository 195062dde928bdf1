#include "app/junit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "geometry/input_error.hpp"
#include "geometry/text.hpp"

namespace trocar::app {
namespace {

std::string xml_text(const std::string& text) {
    constexpr std::size_t longest = 10'000;
    return escape_xml(printable_line(text, longest));
}

/// Line by line, so that line feeds stay.
std::string xml_lines(const std::string& text) {
    std::string result;
    for (std::size_t start = 0; start < text.size();) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        result += xml_text(text.substr(start, end - start)) + "\n";
        start = end + 1;
    }
    return result;
}

std::string outcome_of(const JUnitCase& one) {
    const std::string message = xml_text(one.message);
    switch (one.result) {
        case JUnitCase::Result::passed:
            return fmt::format("<system-out>{}</system-out>", message);
        case JUnitCase::Result::skipped:
            return fmt::format("<skipped message=\"{}\"/>", message);
        case JUnitCase::Result::failed:
            break;
    }
    return fmt::format("<failure type=\"{}\" message=\"{}\">{}</failure>", xml_text(one.type), message,
                       xml_lines(one.details));
}

}  // namespace

std::string junit_text(const std::string& program, const std::vector<JUnitSuite>& suites) {
    std::string text =
        fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\">\n", xml_text(program));
    for (const JUnitSuite& suite : suites) {
        const auto count = [&suite](JUnitCase::Result result) {
            return std::count_if(suite.cases.begin(), suite.cases.end(),
                                 [result](const JUnitCase& one) { return one.result == result; });
        };
        text += fmt::format("  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"{}\">\n",
                            xml_text(suite.name), suite.cases.size(), count(JUnitCase::Result::failed),
                            count(JUnitCase::Result::skipped));
        for (const JUnitCase& one : suite.cases) {
            text += fmt::format("    <testcase classname=\"{}\" name=\"{}\">\n      {}\n    </testcase>\n",
                                xml_text(suite.name), xml_text(one.name), outcome_of(one));
        }
        text += "  </testsuite>\n";
    }
    return text + "</testsuites>\n";
}

}  // namespace trocar::app
