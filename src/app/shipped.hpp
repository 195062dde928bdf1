// Finds shipped scenes and studies, in a clone and after installation. Layout below a root: scenes/NAME.json and
// bench/studies/NAME.json.
#pragma once

#include <filesystem>
#include <vector>

namespace trocar::app {

/// Existing roots in search order: $TROCAR_SHARE, the source tree above the program, share/trocar beside the program's
/// bin, the added root.
std::vector<std::filesystem::path> shipped_roots();

/// For programs installed elsewhere: adds share/trocar of the trocar that they link. Empty: none.
void add_shipped_root(const std::filesystem::path& root);

/// Folder `reports` of every root: where published reports are looked for.
std::vector<std::filesystem::path> shipped_reports();

/// Scene files of every root in order, each name once. Sorted by name within a folder: scenes/ first, then scenes that
/// only studies use.
std::vector<std::filesystem::path> shipped_scenes();

/// Subset that `trocar scenes` lists: without scenes that only studies use.
std::vector<std::filesystem::path> listed_scenes();

/// Resolves a scene. An existing file is returned unchanged; other paths are searched below the roots; a bare name is a
/// scene name, with or without .json. An unresolved path is returned unchanged. Throws InputError with similar names
/// for an unknown bare name.
std::filesystem::path find_scene(const std::filesystem::path& given);

/// Same for a study.
std::filesystem::path find_study(const std::filesystem::path& given);

}  // namespace trocar::app
