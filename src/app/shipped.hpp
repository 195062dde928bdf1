// Finds what comes with the program (scenes, studies) from any folder, so that `trocar run i2t_poke` works in a clone
// and after an installation alike. Both are laid out alike: scenes/NAME.json and bench/studies/NAME.json below a root.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::app {

/// Roots in the order in which they are asked, those that exist: $TROCAR_SHARE, the source tree above the program (a
/// build in a clone), share/trocar beside the program's bin, the added one.
std::vector<std::filesystem::path> shipped_roots();

/// For programs that are not installed with trocar: share/trocar of the trocar they were built against. Empty: none.
void add_shipped_root(const std::filesystem::path& root);

/// Scene files of every root, the first root's first, each name once, sorted by name within a folder: scenes/ first,
/// then those that only studies use.
std::vector<std::filesystem::path> shipped_scenes();

/// Those of them that `trocar scenes` lists: without those that only studies use.
std::vector<std::filesystem::path> listed_scenes();

/// A file that is there is itself; a path that is not is looked up below the roots; a bare name with or without .json
/// is that of a scene. A path without a match comes back as it is, for its reader to complain of. Throws InputError
/// with near names for a bare name that no scene has.
std::filesystem::path find_scene(const std::filesystem::path& given);

/// The same for a study.
std::filesystem::path find_study(const std::filesystem::path& given);

/// Up to three of `names` that `word` may have been meant for: a few letters away, or holding it; nearest first.
std::vector<std::string> near_names(const std::string& word, const std::vector<std::string>& names);

}  // namespace trocar::app
