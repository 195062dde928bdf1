// What a method reports about itself, as data: name, library, parameters and how to make one. Printed by `trocar list`,
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
    /// Extra words accepted beside numbers, such as "none" or "auto".
    std::vector<std::string> words = {};
    /// "AABB|OBB|OBBRSS", "[0, 10]", "integer >= 1" …
    [[nodiscard]] std::string range() const;
};

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

/// How much a detector can report.
enum class InformationLevel { any, pairs, contacts };

struct DetectorEntry {
    std::string name = {};
    std::string library = "trocar";  ///< library and version text, e.g. "FCL" "0.7.0"
    std::string version = {};
    std::string configuration = {};  ///< build facts asserted at start-up (precision, SIMD …), printed in the report
    InformationLevel information = InformationLevel::pairs;
    bool own = false;              ///< ours, as opposed to a baseline's; distinguished in tables
    bool claims_exact = false;     ///< pair sets must equal truth
    bool native_contacts = false;  ///< fills ContactSet::native
    bool query_distance = false;   ///< answers pairs within a query distance; otherwise a reach above 0 is unsupported
    bool control = false;          ///< holds others to account (CONTACT §5); never ranked, no method
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
    /// Names of the contact generators that it can work from, its default first.
    std::vector<std::string> contact_generators = {"tracked_proximity", "proximity", "intersection", "native"};
    /// Where its parameters decide too: why it cannot work from a source of the list with these; empty when it can.
    std::function<std::string(const ParameterValues&, std::string_view generator)> why_unreadable = {};
    std::string without_tissue = {};  ///< what it does between bodies without tissue, where that is another method's
    std::string same_as = {};  ///< where it is another method on tissue too, to the bit: one line; empty: nowhere
    bool control = false;      ///< holds others to account (CONTACT §5); never ranked, no method
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Response>(const ParameterValues&)> make = {};
};

/// How contacts are made from a detector's answer, the same for every detector.
struct ContactGeneratorEntry {
    std::string name = {};
    std::string library = "trocar";
    std::string version = {};
    std::string meaning = {};  ///< one line
    bool wants_query_distance =
        false;                  ///< asks detectors for pairs within a query distance, not for those that meet alone
    bool wants_native = false;  ///< asks detectors for their own contacts
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<ContactGenerator>(const ParameterValues&)> make = {};
};

/// How tissue moves under a response output.
struct StepperEntry {
    std::string name = {};
    std::string library = "trocar";
    std::string version = {};
    std::string meaning = {};               ///< one line
    bool is_default = false;                ///< taken where nobody names one
    bool takes_contact_force_laws = false;  ///< those with a force law
    bool takes_solved_contacts = false;     ///< asks ResponseOutput::solver
    bool takes_position_corrections = false;
    bool takes_held_forces = false;
    std::vector<Parameter> parameters = {};
    std::function<std::unique_ptr<Stepper>(const ParameterValues&)> make = {};
};

/// What was given to an entry, checked. Throws as ParameterValues does.
template <typename Entry>
ParameterValues checked_values(const Entry& entry, const std::map<std::string, std::string>& given) {
    return ParameterValues(entry.name, entry.parameters, given);
}

/// Why a source cannot work from a detector's answer; empty when it can.
std::string why_unreported(const DetectorEntry& detector, const ContactGeneratorEntry& generator);
/// What of a response output a stepper does not take; empty when it takes all. Contacts that push no tissue are not its
/// own.
std::string why_not_taken(const StepperEntry& stepper, const Topology& topology, const ResponseOutput& output);

}  // namespace trocar
