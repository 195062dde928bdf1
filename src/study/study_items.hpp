// Readers for the items of a study file. Each item is checked against the registry and the file system. Every fault is
// an InputError with its JSON pointer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "scene/json_node.hpp"
#include "study/study.hpp"

namespace trocar {

/// Throws unless the node is an object with all `required` keys and no key outside `known`.
void expect_object(const JsonNode& node, const std::vector<std::string>& known,
                   const std::vector<std::string>& required);
/// A non-empty list.
std::vector<JsonNode> items_of(const JsonNode& node);
/// An integer >= `least`.
std::int64_t count_of(const JsonNode& node, std::int64_t least = 1);

/// Readers for the further keys of a method that is an object, by key.
using MoreKeys = std::map<std::string, std::function<void(const JsonNode&, Level&)>>;
/// Reads a method from text, or from an object with its setting and basis. `inputs`: files of the experiment, of which
/// the object may name a subset.
Level read_method(const JsonNode& node, bool is_detector, const std::vector<std::string>& inputs = {},
                  const MoreKeys& more_keys = {});
/// A list of distinct methods, or "all": every method of the build, absent ones included.
std::vector<Level> read_methods(const JsonNode& node, bool is_detector, const std::vector<std::string>& inputs,
                                const MoreKeys& more_keys = {});
/// Checks a parameter by constructing every method of the list with it.
void check_parameter(const JsonNode& node, const std::vector<Level>& methods, bool is_detector, const std::string& key,
                     const std::string& value);

/// Adds a method of the command line to the experiments that compare methods of its kind: those without a sweep, judged
/// and not paced; a detector not to closed loops on cases and under perturbations, whose subject is the response.
/// Throws InputError for an unknown method, and for a study without such an experiment.
void add_method(const std::string& text, Study& study);

/// Search path for the scenes of a study.
struct SceneFiles {
    std::filesystem::path study;                 ///< the study file; scenes relative to it come first
    std::vector<std::filesystem::path> shipped;  ///< then these, matched by name
    std::string start = "the study file";        ///< what paths are relative to, in words
};

/// Existing scene files without repetition, as paths relative to the study file. A bare name, with or without .json,
/// may be that of a shipped scene. Shell patterns after the last slash expand to the matching files.
std::vector<std::string> read_scenes(const JsonNode& node, const SceneFiles& files);
/// One contact generator of this build.
std::string read_contact_generator(const JsonNode& node);
/// Distinct contact generators of this build.
std::vector<std::string> read_contact_generators(const JsonNode& node);
/// A stepper as RunSpec::stepper.
std::string read_stepper(const JsonNode& node);
/// Distinct ones.
std::vector<std::string> read_steppers(const JsonNode& node);
/// An object of settings, or the text of a command line. Result as RunSpec::device.
std::string read_device_of(const JsonNode& node);

}  // namespace trocar
