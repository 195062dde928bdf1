#include "method/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "method/contact_selection.hpp"
#include "method/device.hpp"
#include "method/outside.hpp"
#include "scene/retired_names.hpp"

namespace trocar {

/// Defined in the file that CMake writes from the trocar_add_* lines.
void register_all_methods(Registry& registry);

namespace {

template <typename Entry>
const Entry* find(const std::vector<Entry>& entries, std::string_view name) {
    for (const Entry& entry : entries) {
        if (entry.name == name) return &entry;
    }
    return nullptr;
}

template <typename Entry>
void replace_in(std::vector<Entry>& entries, Entry entry) {
    const auto place =
        std::find_if(entries.begin(), entries.end(), [&entry](const Entry& one) { return one.name == entry.name; });
    *place = std::move(entry);
}

template <typename Entry>
const Entry& look_up(NameKind name_kind, std::string_view kind, const std::vector<Entry>& present,
                     const std::vector<AbsentMethod>& absent, std::string_view name) {
    if (const Entry* entry = find(present, name)) return *entry;
    if (const AbsentMethod* entry = find(absent, name)) {
        throw InputError(kind, "", fmt::format("a {} that this build has", kind),
                         fmt::format("'{}', absent ({})", name, entry->reason));
    }
    std::vector<std::string> known;
    known.reserve(present.size());
    for (const Entry& entry : present) known.push_back(entry.name);
    throw InputError(kind, "", fmt::format("one of {}", fmt::join(known, ", ")),
                     with_replacement(fmt::format("'{}'", name), name_kind, "", name));
}

}  // namespace

void Registry::check_new(std::string_view kind, std::string_view name) const {
    bool taken = false;
    if (kind == "detector") taken = find(detectors_, name) != nullptr || find(absent_detectors_, name) != nullptr;
    if (kind == "response") taken = find(responses_, name) != nullptr || find(absent_responses_, name) != nullptr;
    if (kind == "contact generator") taken = find(contact_generators_, name) != nullptr;
    if (kind == "stepper") taken = find(steppers_, name) != nullptr;
    if (taken) throw std::logic_error(fmt::format("two {}s are named '{}'", kind, name));
}

void Registry::add(DetectorEntry entry) {
    check_new("detector", entry.name);
    detectors_.push_back(std::move(entry));
}

void Registry::add(ResponseEntry entry) {
    check_new("response", entry.name);
    entry.parameters.push_back(look_ahead_parameter());
    responses_.push_back(std::move(entry));
}

void Registry::add(ContactGeneratorEntry entry) {
    check_new("contact generator", entry.name);
    contact_generators_.push_back(std::move(entry));
}

void Registry::add(StepperEntry entry) {
    check_new("stepper", entry.name);
    steppers_.push_back(std::move(entry));
}

void Registry::replace(DetectorEntry entry) { replace_in(detectors_, std::move(entry)); }

void Registry::replace(ResponseEntry entry) {
    entry.parameters.push_back(look_ahead_parameter());
    replace_in(responses_, std::move(entry));
}

void Registry::add_absent_detector(AbsentMethod absent) {
    check_new("detector", absent.name);
    absent_detectors_.push_back(std::move(absent));
}

void Registry::add_absent_response(AbsentMethod absent) {
    check_new("response", absent.name);
    absent_responses_.push_back(std::move(absent));
}

const DetectorEntry& Registry::detector(std::string_view name) const {
    return look_up(NameKind::detector, "detector", detectors_, absent_detectors_, name);
}

const ResponseEntry& Registry::response(std::string_view name) const {
    return look_up(NameKind::response, "response", responses_, absent_responses_, name);
}

const ContactGeneratorEntry& Registry::contact_generator(std::string_view name) const {
    return look_up(NameKind::contact_generator, "contact generator", contact_generators_, {}, name);
}

const StepperEntry& Registry::stepper(std::string_view name) const {
    return look_up(NameKind::stepper, "stepper", steppers_, {}, name);
}

const StepperEntry& Registry::default_stepper() const {
    for (const StepperEntry& entry : steppers_) {
        if (entry.is_default) return entry;
    }
    throw std::logic_error("no stepper is marked default");
}

namespace {

struct Outside {
    std::vector<void (*)(Registry&)> add;
    std::vector<std::string> names;
    bool is_over = false;  ///< the registry is filled
};

Outside& outside() {
    static Outside all;
    return all;
}

template <typename Entry>
void append_names(const std::vector<Entry>& entries, std::size_t from, std::vector<std::string>& names) {
    for (std::size_t i = from; i < entries.size(); ++i) names.push_back(entries[i].name);
}

void add_outside_methods(Registry& filled) {
    outside().is_over = true;
    const std::size_t detectors = filled.detectors().size();
    const std::size_t responses = filled.responses().size();
    const std::size_t contact_generators = filled.contact_generators().size();
    const std::size_t steppers = filled.steppers().size();
    try {
        for (const auto add : outside().add) add(filled);
    } catch (const std::logic_error& error) {
        throw InputError("methods of this program", "", "names that no other method has", error.what());
    }
    std::vector<std::string>& names = outside().names;
    names.clear();
    append_names(filled.detectors(), detectors, names);
    append_names(filled.responses(), responses, names);
    append_names(filled.contact_generators(), contact_generators, names);
    append_names(filled.steppers(), steppers, names);
}

}  // namespace

OutsideMethod::OutsideMethod(void (*add)(Registry&)) {
    if (outside().is_over) throw std::logic_error("a method joins after the registry was asked");
    outside().add.push_back(add);
}

namespace {

Registry& filled_registry() {
    static Registry instance = [] {
        Registry filled;
        register_all_methods(filled);
        add_outside_methods(filled);
        return filled;
    }();
    return instance;
}

template <typename Entry>
void add_or_replace(Entry entry) {
    static std::set<std::string> added;
    const std::string name = entry.name;
    if (added.contains(name)) {
        filled_registry().replace(std::move(entry));
        return;
    }
    try {
        filled_registry().add(std::move(entry));
    } catch (const std::logic_error& error) {
        throw InputError("methods of this program", "", "names that no other method has", error.what());
    }
    added.insert(name);
    outside().names.push_back(name);
}

}  // namespace

void add_outside_method(DetectorEntry entry) { add_or_replace(std::move(entry)); }
void add_outside_method(ResponseEntry entry) { add_or_replace(std::move(entry)); }

const std::vector<std::string>& outside_methods() {
    registry();
    return outside().names;
}

const Registry& registry() { return filled_registry(); }

std::string MethodSpec::text() const {
    std::string result = name;
    char separator = ':';
    for (const auto& [key, value] : parameters) {
        result += fmt::format("{}{}={}", separator, key, value);
        separator = ',';
    }
    return result;
}

std::map<std::string, std::string> parse_settings(std::string_view text,
                                                  const std::function<InputError(const std::string&)>& malformed) {
    std::map<std::string, std::string> settings;
    while (true) {
        const auto comma = text.find(',');
        const std::string_view item = text.substr(0, comma);
        const auto equals = item.find('=');
        if (equals == std::string_view::npos || equals == 0 || equals + 1 == item.size()) {
            throw malformed(fmt::format("'{}' is not key=value", item));
        }
        if (!settings.emplace(item.substr(0, equals), item.substr(equals + 1)).second) {
            throw malformed(fmt::format("'{}' given twice", item.substr(0, equals)));
        }
        if (comma == std::string_view::npos) return settings;
        text = text.substr(comma + 1);
    }
}

MethodSpec parse_method(std::string_view text) {
    const auto malformed = [text](const std::string& found) {
        return InputError("method", "", "NAME or NAME:key=value[,key=value...]", fmt::format("'{}' ({})", text, found));
    };
    MethodSpec spec;
    const auto colon = text.find(':');
    spec.name = std::string(text.substr(0, colon));
    if (spec.name.empty()) throw malformed("no name");
    if (colon != std::string_view::npos) spec.parameters = parse_settings(text.substr(colon + 1), malformed);
    return spec;
}

namespace {

MethodSpec with_parameters(std::string_view text, const std::map<std::string, std::string>& parameters) {
    MethodSpec spec = parse_method(text);
    for (const auto& [key, value] : parameters) spec.parameters.insert_or_assign(key, value);
    return spec;
}

}  // namespace

std::unique_ptr<Detector> make_detector(std::string_view name, const std::map<std::string, std::string>& parameters) {
    const MethodSpec method = with_parameters(name, parameters);
    const DetectorEntry& entry = registry().detector(method.name);
    return entry.make(checked_values(entry, method.parameters));
}

std::unique_ptr<Response> make_response(std::string_view name, const std::map<std::string, std::string>& parameters) {
    const MethodSpec method = with_parameters(name, parameters);
    const ResponseEntry& entry = registry().response(method.name);
    return make_selecting(entry, checked_values(entry, method.parameters));
}

std::string why_unreadable(const ContactGeneratorEntry& contact_generator, const MethodSpec& response) {
    const ResponseEntry& entry = registry().response(response.name);
    if (std::find(entry.contact_generators.begin(), entry.contact_generators.end(), contact_generator.name) ==
        entry.contact_generators.end()) {
        return fmt::format("{} works from contacts {}, not from '{}'", entry.name,
                           fmt::join(entry.contact_generators, ", "), contact_generator.name);
    }
    if (!entry.why_unreadable) return {};
    return entry.why_unreadable(ParameterValues(entry.name, entry.parameters, response.parameters),
                                contact_generator.name);
}

std::string default_contact_generator(const MethodSpec& response) {
    const std::vector<std::string>& contact_generators = registry().response(response.name).contact_generators;
    const auto first = std::find_if(
        contact_generators.begin(), contact_generators.end(), [&response](const std::string& contact_generator) {
            return why_unreadable(registry().contact_generator(contact_generator), response).empty();
        });
    return first == contact_generators.end() ? contact_generators.front() : *first;
}

std::unique_ptr<ContactGenerator> make_contact_generator(std::string_view name,
                                                         const std::map<std::string, std::string>& parameters) {
    const MethodSpec method = with_parameters(name, parameters);
    const ContactGeneratorEntry& entry = registry().contact_generator(method.name);
    return entry.make(checked_values(entry, method.parameters));
}

std::string stepper_text(std::string_view text) {
    const MethodSpec spec = parse_method(text);
    make_stepper(spec.name, spec.parameters);
    const bool is_default = spec.name == registry().default_stepper().name && spec.parameters.empty();
    return is_default ? std::string() : spec.text();
}

std::unique_ptr<Stepper> make_stepper(std::string_view name, const std::map<std::string, std::string>& parameters) {
    const MethodSpec method = with_parameters(name, parameters);
    const StepperEntry& entry = registry().stepper(method.name);
    return entry.make(checked_values(entry, method.parameters));
}

}  // namespace trocar
