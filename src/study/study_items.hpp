// What the parts of a study file have in common: methods, scenes, sources, steppers, devices and counts, each checked
// against the registry and the folder. Every fault is an InputError with its place in the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/json_node.hpp"
#include "study/study.hpp"

namespace trocar {

/// An object with known keys only, and all of `required`.
void expect_object(const JsonNode& node, const std::vector<std::string>& known,
                   const std::vector<std::string>& required);
/// A list that is not empty.
std::vector<JsonNode> items_of(const JsonNode& node);
/// A whole number from 1 on.
std::int64_t count_of(const JsonNode& node);

/// One of `scenes`, as it stands there or, without a folder, by its name.
std::string scene_of(const JsonNode& item, const std::vector<std::string>& scenes);
/// A method as text, or as an object with its setting and basis; with `scenes` also with those of them that it runs on.
/// `more_keys` are the caller's.
StudyMethod read_method(const JsonNode& node, bool is_detector, const std::vector<std::string>& scenes = {},
                        const std::vector<std::string>& more_keys = {});
/// Whether "all" stands where a list of methods could.
bool names_all(const JsonNode& node);
/// A list of methods, each once; or "all": every method of the build, the absent ones too.
std::vector<StudyMethod> read_methods(const JsonNode& node, bool is_detector, const std::vector<std::string>& scenes,
                                      const std::vector<std::string>& more_keys = {});
/// Checks a parameter of every method of the list by making the method with it.
void check_parameter(const JsonNode& node, const std::vector<StudyMethod>& methods, bool is_detector,
                     const std::string& key, const std::string& value);

/// Adds a method that the command line names to the parts that take one of its kind: replay, closed loop, hard cases,
/// metamorphic test. Throws InputError for an unknown method, and for a study without such a part.
void add_method(const std::string& text, Study& study);

/// Where the scenes of a study are searched for.
struct SceneFiles {
    std::filesystem::path study;                 ///< the study file: first what lies relative to it
    std::vector<std::filesystem::path> shipped;  ///< then these, by name
};

/// A response that none of these sources serves works from its own instead, the one of `trocar run`. What the response
/// itself names, and what this build lacks, stays.
void serve(const std::vector<std::string>& contacts, StudyMethod& response);

/// Scene files that are there, each once, as paths relative to the study file. A name without a folder, with or without
/// .json, may be that of a shipped scene; patterns of a shell behind the last slash stand for what fits them.
std::vector<std::string> read_scenes(const JsonNode& node, const SceneFiles& files);
/// Name of a contact generator of this build.
std::string read_contact_generator(const JsonNode& node);
/// As RunSpec::stepper has them, each once.
std::vector<std::string> read_steppers(const JsonNode& node);
/// An object of settings, or the text of a command line. As RunSpec::device has it.
std::string read_device_of(const JsonNode& node);

/// Ticks (0: the scene's), repetitions and truth stride of a part.
template <typename Part>
void read_counts(const JsonNode& node, std::int64_t repetitions, Part& part) {
    part.repetitions = node.has("repetitions") ? count_of(node.at("repetitions")) : repetitions;
    part.ticks = node.has("ticks") ? count_of(node.at("ticks")) : 0;
    part.truth_stride = node.has("truth_stride") ? count_of(node.at("truth_stride")) : 1;
}

}  // namespace trocar
