// Hard cases of scenes/hard: folders with `expected.json`, which holds the category, the right answer and its reason. A
// case is two meshes with their pairs, or a scene with bounds on figures. Studies run every method on them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct HardCase {
    std::filesystem::path file;  ///< its expected.json
    std::string name;            ///< folder name
    std::string of;              ///< category: entry of the list of hard cases
    std::string reason;          ///< why the answer is right

    /// Meshes a.obj and b.obj beside the file: intersecting triangles, numbered per file from 0.
    std::optional<std::vector<std::array<Index, 2>>> pairs;
    std::vector<Index> touch;  ///< positions in `pairs` that only touch
    Index not_finite = -1;     ///< vertex of a that is NaN in the frame; `pairs` is then empty

    std::filesystem::path scene;            ///< relative to the file
    std::int64_t ticks = 0;                 ///< overrides the scene's number; 0: the scene's
    std::map<std::string, double> at_most;  ///< upper bounds of figures of the run's summary

    OutcomeKind outcome = OutcomeKind::ok;  ///< required of every method
};

/// Throws InputError with a JSON pointer for an unknown key, a wrong type, or unless the case is of one kind.
HardCase read_hard_case(const std::filesystem::path& file);

/// All cases of a folder, sorted by name. Throws InputError when there is none.
std::vector<HardCase> read_hard_cases(const std::filesystem::path& folder);

/// Hash over the bytes of the files of a case of meshes, 16 hex digits.
std::string hash_of(const HardCase& hard_case);

/// Runs one detector on a case of meshes. The summary holds true_pairs, true_touches, false_negatives,
/// false_negatives_touch and false_positives against the case's own list. The outcome is the detector's, and not_finite
/// for native contacts with non-finite numbers.
Record run_hard_case(const HardCase& hard_case, const RunSpec& spec);

}  // namespace trocar
