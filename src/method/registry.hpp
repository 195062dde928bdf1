// All methods by name, present or absent with the reason. CMake generates the table that fills it from the
// trocar_add_detector, trocar_add_response, trocar_add_contact_generator and trocar_add_stepper lines. No code above
// this file names a method.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/input_error.hpp"
#include "method/entry.hpp"

namespace trocar {

/// A method named in a build file whose library was not found.
struct AbsentMethod {
    std::string name;
    std::string reason;
};

class Registry {
public:
    /// Throws std::logic_error on a duplicate name.
    void add(DetectorEntry entry);
    void add(ResponseEntry entry);
    void add(ContactGeneratorEntry entry);
    void add(StepperEntry entry);
    /// Replaces the entry of that name. Precondition: there is one.
    void replace(DetectorEntry entry);
    void replace(ResponseEntry entry);
    void add_absent_detector(AbsentMethod absent);
    void add_absent_response(AbsentMethod absent);

    [[nodiscard]] const std::vector<DetectorEntry>& detectors() const { return detectors_; }
    [[nodiscard]] const std::vector<ResponseEntry>& responses() const { return responses_; }
    [[nodiscard]] const std::vector<ContactGeneratorEntry>& contact_generators() const { return contact_generators_; }
    [[nodiscard]] const std::vector<StepperEntry>& steppers() const { return steppers_; }
    [[nodiscard]] const std::vector<AbsentMethod>& absent_detectors() const { return absent_detectors_; }
    [[nodiscard]] const std::vector<AbsentMethod>& absent_responses() const { return absent_responses_; }

    /// Throws InputError when the name is unknown (with the known names) or absent (with the reason).
    [[nodiscard]] const DetectorEntry& detector(std::string_view name) const;
    [[nodiscard]] const ResponseEntry& response(std::string_view name) const;
    [[nodiscard]] const ContactGeneratorEntry& contact_generator(std::string_view name) const;
    [[nodiscard]] const StepperEntry& stepper(std::string_view name) const;
    /// The entry with is_default.
    [[nodiscard]] const StepperEntry& default_stepper() const;

private:
    void check_new(std::string_view kind, std::string_view name) const;
    std::vector<DetectorEntry> detectors_;
    std::vector<ResponseEntry> responses_;
    std::vector<ContactGeneratorEntry> contact_generators_;
    std::vector<StepperEntry> steppers_;
    std::vector<AbsentMethod> absent_detectors_;
    std::vector<AbsentMethod> absent_responses_;
};

const Registry& registry();

/// Parsed NAME[:key=value[,key=value…]].
struct MethodSpec {
    std::string name;
    std::map<std::string, std::string> parameters = {};
    /// Inverse of parse_method, parameters in alphabetical order.
    [[nodiscard]] std::string text() const;
};

/// Parses key=value[,key=value…]. Throws the error that `malformed` makes of the fault.
std::map<std::string, std::string> parse_settings(std::string_view text,
                                                  const std::function<InputError(const std::string&)>& malformed);

/// Throws InputError on a malformed text; does not check names and keys.
MethodSpec parse_method(std::string_view text);

/// Text of a stepper as records have it: checked, and empty for the default one. Throws as make_stepper.
std::string stepper_text(std::string_view text);

/// name: as for parse_method. Throws InputError for an unknown or absent name or key, or a value out of range.
std::unique_ptr<Detector> make_detector(std::string_view name,
                                        const std::map<std::string, std::string>& parameters = {});
std::unique_ptr<Response> make_response(std::string_view name,
                                        const std::map<std::string, std::string>& parameters = {});
/// Reason why a response with these parameters cannot use a generator's contacts; empty when it can. Throws as
/// make_response does.
std::string why_unreadable(const ContactGeneratorEntry& contact_generator, const MethodSpec& response);
/// Default contact generator of a response: the first of its entry that it can use with its parameters.
std::string default_contact_generator(const MethodSpec& response);
std::unique_ptr<ContactGenerator> make_contact_generator(std::string_view name,
                                                         const std::map<std::string, std::string>& parameters = {});
std::unique_ptr<Stepper> make_stepper(std::string_view name, const std::map<std::string, std::string>& parameters = {});

}  // namespace trocar
