// Metadata of a method: name, library, parameters and factory. `trocar list`, reports and tests read it, so that each
// list exists only once.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "method/contact_generator.hpp"
#include "method/detector.hpp"
#include "method/response.hpp"
#include "method/stepper.hpp"

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
    /// Words accepted besides numbers, such as "none" or "auto".
    std::vector<std::string> words = {};
    /// "AABB|OBB|OBBRSS", "number 0 to 10", "integer >= 1" …
    [[nodiscard]] std::string range() const;
};

/// Numeric parameter in [low, high] or one of `words`.
Parameter number_parameter(const std::string& name, const std::string& unit, const std::string& default_value,
                           double low, double high, const std::string& meaning, std::vector<std::string> words = {});
/// Whole number in [low, high] or one of `words`.
Parameter integer_parameter(const std::string& name, const std::string& default_value, double low, double high,
                            const std::string& meaning, std::vector<std::string> words = {});
Parameter choice_parameter(const std::string& name, const std::string& default_value, std::vector<std::string> choices,
                           const std::string& meaning);

/// A method's settings after checking against its declarations: every declared parameter has a value.
class ParameterValues {
public:
    /// Throws InputError that names the method, the parameter, what was expected and what was found, and the
    /// replacement of a retired parameter or value.
    ParameterValues(std::string_view method, const std::vector<Parameter>& declared,
                    const std::map<std::string, std::string>& given);
    [[nodiscard]] bool has(std::string_view name) const { return values_.find(name) != values_.end(); }
    [[nodiscard]] const std::string& text(std::string_view name) const;
    [[nodiscard]] double number(std::string_view name) const;  ///< NaN when the value is one of `words`
    [[nodiscard]] std::int64_t integer(std::string_view name) const;
    [[nodiscard]] bool is(std::string_view name, std::string_view value) const { return text(name) == value; }

private:
    std::map<std::string, std::string, std::less<>> values_;
};

struct DetectorEntry {
    std::string name = {};
    std::string library = "trocar";  ///< name of the library, e.g. "FCL"
    std::string version = {};
    std::string configuration = {};  ///< build facts asserted at start-up (precision, SIMD …), printed in the report
    bool own = false;                ///< implemented in trocar, not in a third-party library
    bool claims_exact = false;       ///< pair sets must equal those of the exact reference
    bool native_contacts = false;    ///< fills ContactSet::native
    bool query_distance = false;     ///< finds pairs within a query distance; false: > 0 is unsupported
    bool control = false;            ///< control for validation (CONTACT §5), not a method; never ranked
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Detector>(const ParameterValues&)> make = {};
};

struct ResponseEntry {
    std::string name = {};
    std::string library = "trocar";
    std::string version = {};
    std::string configuration = {};
    std::string table_row = "none";  ///< row of the thesis' Table 2.1 that it implements
    bool own = false;
    /// Contact generators that it can use, its default first.
    std::vector<std::string> contact_generators = {"tracked_proximity", "proximity", "intersection", "native"};
    /// Reason why it cannot use a listed generator with these parameters; empty when it can. Null: no restriction.
    std::function<std::string(const ParameterValues&, std::string_view generator)> why_unreadable = {};
    std::string without_tissue = {};  ///< behaviour between bodies without tissue, if it is another method's
    std::string same_as = {};         ///< bitwise equality with another method, also on tissue: one line
    bool control = false;             ///< control for validation (CONTACT §5), not a method; never ranked
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Response>(const ParameterValues&)> make = {};
};

/// A contact generator, the same for every detector.
struct ContactGeneratorEntry {
    std::string name = {};
    std::string library = "trocar";
    std::string version = {};
    std::string meaning = {};           ///< one line
    bool wants_query_distance = false;  ///< needs pairs within a query distance
    bool wants_native = false;          ///< needs native contacts
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<ContactGenerator>(const ParameterValues&)> make = {};
};

/// Time integration of tissue under a response output.
struct StepperEntry {
    std::string name = {};
    std::string library = "trocar";
    std::string version = {};
    std::string meaning = {};               ///< one line
    bool is_default = false;                ///< used if none is named
    bool takes_contact_force_laws = false;  ///< contacts of all roles but `solved`
    bool takes_solved_contacts = false;     ///< calls ResponseOutput::solver
    bool takes_position_corrections = false;
    bool takes_held_forces = false;
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Stepper>(const ParameterValues&)> make = {};
};

/// Checks `given` against the entry's parameters. Throws as ParameterValues does.
template <typename Entry>
ParameterValues checked_values(const Entry& entry, const std::map<std::string, std::string>& given) {
    return ParameterValues(entry.name, entry.parameters, given);
}

/// Reason why the generator cannot use the detector's output; empty when it can.
std::string why_unreported(const DetectorEntry& detector, const ContactGeneratorEntry& generator);
/// First part of a response output that the stepper does not support; empty if it supports all. Contacts that push no
/// tissue are ignored.
std::string why_not_taken(const StepperEntry& stepper, const Topology& topology, const ResponseOutput& output);

}  // namespace trocar
