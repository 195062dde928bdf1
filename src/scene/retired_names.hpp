// Names that a user could type once and that exist no more. The one table of them serves methods, parameters, values of
// parameters and keys of files.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace trocar {

enum class NameKind : std::uint8_t {
    detector,
    contact_generator,
    response,
    stepper,
    parameter,  ///< of a method or of the device; or PARAMETER=VALUE, where the value alone is retired
    scene_key,
    study_key
};

struct RetiredName {
    NameKind kind;
    /// A parameter's method, or "device"; a file key's nearest enclosing key. Empty: all of them, and the kinds of
    /// methods.
    std::string_view scope;
    std::string_view name;
    std::string_view use;  ///< end of the error line: "renamed to 'NEW'", or what to do instead
};

/// The table, for tests.
std::span<const RetiredName> retired_names();

/// `use` of the row that fits, one with a scope before one for all; empty when there is none. Look names up elsewhere
/// first: a name in use may stand in the table.
std::string_view replacement_of(NameKind kind, std::string_view scope, std::string_view name);

/// The finding of an InputError: `found`, followed by the replacement where the name is retired.
std::string with_replacement(std::string found, NameKind kind, std::string_view scope, std::string_view name);

}  // namespace trocar
