// What a method tells about itself, as data: name, library, parameters and how to make one. Printed by `trocar list`,
// by the report and by the tests, so that a list exists only once.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "method/detector.hpp"
#include "method/response.hpp"

namespace trocar {

/// A declared setting of a method.
struct Parameter {
    enum class Type { number, integer, choice };
    std::string name = {};
    Type type = Type::number;
    std::string unit = {};           ///< SI, "1" for a pure number, "" for a choice
    std::string default_value = {};  ///< as written on a command line
    double minimum = -std::numeric_limits<double>::infinity();
    double maximum = std::numeric_limits<double>::infinity();
    std::vector<std::string> choices = {};  ///< for Type::choice
    std::string meaning = {};
    /// Extra words accepted beside numbers, such as "none" or "auto".
    std::vector<std::string> words = {};
    /// "AABB|OBB|OBBRSS", "[0, 10]", "integer >= 1" …
    [[nodiscard]] std::string range() const;
};

/// A method's settings after checking against its declarations: every declared parameter has a value.
class ParameterValues {
public:
    /// Throws InputError that names the method, the parameter, what was expected and what was found.
    ParameterValues(std::string_view method, const std::vector<Parameter>& declared,
                    const std::map<std::string, std::string>& given);
    [[nodiscard]] const std::string& text(std::string_view name) const;
    [[nodiscard]] double number(std::string_view name) const;  ///< NaN when the value is one of `words`
    [[nodiscard]] std::int64_t integer(std::string_view name) const;
    [[nodiscard]] bool is(std::string_view name, std::string_view value) const { return text(name) == value; }

private:
    std::map<std::string, std::string, std::less<>> values_;
};

/// How much a detector can tell.
enum class InformationLevel { any, pairs, contacts };

struct DetectorEntry {
    std::string name = {};
    std::string library = "trocar";  ///< library and version text, e.g. "FCL" "0.7.0"
    std::string version = {};
    std::string configuration = {};  ///< build facts asserted at start-up (precision, SIMD …), printed in the report
    InformationLevel information = InformationLevel::pairs;
    bool own = false;              ///< ours, as opposed to a rival's; told apart in tables
    bool claims_exact = false;     ///< pair sets must equal truth
    bool native_contacts = false;  ///< fills ContactSet::native
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Detector>(const ParameterValues&)> make = {};
};

struct ResponseEntry {
    std::string name = {};
    std::string library = "trocar";
    std::string version = {};
    std::string configuration = {};
    std::string table_row = "none";  ///< row of the thesis' Table 2.1 that it stands for
    bool own = false;
    bool needs_native = false;  ///< reads only native contacts
    /// Can work from a point, a normal and a depth alone, which is all that native contacts hold.
    bool reads_native = true;
    std::string without_tissue = {};  ///< what it does between bodies without tissue, where that is another method's
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Response>(const ParameterValues&)> make = {};
};

}  // namespace trocar
