// The hard cases of scenes/hard: each is a folder with `expected.json`, which says what it is a case of, what the right
// answer is and why. A case is two meshes with their pairs, a file that must be refused, a scene with bounds on what
// may come of it, or the name of the test that holds it. Studies ask every method; the report makes the matrix.
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
    std::string name;            ///< of its folder
    std::string of;              ///< the entry of the list of hard cases that it belongs to
    std::string reason;          ///< why the answer is the right one

    /// Two meshes a.obj and b.obj beside the file: the intersecting triangles, numbered in each file from 0.
    std::optional<std::vector<std::array<Index, 2>>> pairs;
    std::vector<Index> touch;  ///< positions in `pairs` that only touch
    Index not_finite = -1;     ///< vertex of a that is NaN in the frame; `pairs` is then empty

    std::string bad_input;  ///< what the complaint about a.obj, else scene.json, beside the file must name

    std::filesystem::path scene;            ///< relative to the file
    std::int64_t ticks = 0;                 ///< instead of the scene's own number; 0: as the scene says
    std::map<std::string, double> at_most;  ///< figures of the run's summary and their largest right values

    /// How a method must end on meshes and scenes.
    OutcomeKind outcome = OutcomeKind::ok;

    std::string tested;  ///< "FILE: SUITE.TEST" that holds it
};

/// Throws InputError with a JSON pointer for an unknown key, a wrong type, or a case of no kind or of two.
HardCase read_hard_case(const std::filesystem::path& file);

/// All cases of a folder in the order of their names. Throws InputError when there is none.
std::vector<HardCase> read_hard_cases(const std::filesystem::path& folder);

/// Over the bytes of the case's own files, 16 hex digits.
std::string hash_of(const HardCase& hard_case);

/// One detector on one case of meshes, or (spec.detector empty) the reading of a file that must be refused. The summary
/// holds true_pairs, true_touches, missing, false_negatives_touch and extra against the case's own list; the outcome is
/// what the detector said, not_finite also for native contacts that are no numbers.
Record run_hard_case(const HardCase& hard_case, const RunSpec& spec);

/// One detector on a file of triangle pairs with truth, each pair a world of its own; true_pairs, missing and extra
/// count lines. The outcome is that of the first line on which the detector failed, failed_ticks their number.
Record run_pair_family(const std::filesystem::path& file, const RunSpec& spec);

}  // namespace trocar
