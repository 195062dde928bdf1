// Detectors on other groups' data sets (scene/external_frames.hpp). On frames they take turns in one process. On
// queries with known answers each runs alone.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "measure/record.hpp"
#include "scene/external_frames.hpp"

namespace trocar {

/// Rounds of a run whose specification names no number of ticks.
inline constexpr std::int64_t external_rounds = 5;

/// Asks each detector for every frame, RunSpec::ticks times in random order; where the data set has a motion, for its
/// second frame. One record each, in the order of `specs`. Times are CPU time of the process. The first round is
/// judged: pairs by the exact oracle. Beginnings are the source's meeting pairs less those that meet at the first frame
/// by that oracle. A beginning is found when its pair is reported between the frames or at the second one. `turn`:
/// called with the position of a run before its turn, to attribute a crash. Failures are outcomes of their records.
std::vector<Record> run_external(const ExternalFrames& data, std::span<const RunSpec> specs,
                                 const std::function<void(std::size_t)>& turn = {});

/// Runs one detector on a file of continuous queries, each as a separate world. A query is found when its pair is
/// reported at one of the two frames or between them. judged_ticks, true_pairs, false_negatives and false_positives
/// count queries; failed_ticks counts failed ones, and the outcome is that of the first of them.
Record run_ccd_queries(const std::filesystem::path& file, const RunSpec& spec);

/// The same for a file of triangle pairs at rest (geometry/pair_file.hpp), of those lines that state the truth.
Record run_pair_family(const std::filesystem::path& file, const RunSpec& spec);

}  // namespace trocar
