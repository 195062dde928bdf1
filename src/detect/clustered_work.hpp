// Data shared by the stages of ohc_clustered: settings, and the clock that dates all motion relative to the last
// answer. The work counters are those of ohc (ohc_work.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "detect/clusters.hpp"
#include "detect/shared_parameters.hpp"

namespace trocar {

/// Number of regions, cells, candidates and pairs of an ordinary contact: reserved before the first tick.
inline constexpr std::size_t ordinary_contact = 4096;

struct ClusteredSettings : SharedSettings {
    ClusterOrder order = ClusterOrder::automatic;
    bool scalar = false;
};

/// Selects the version of a kernel from versions_by_target: scalar or best.
template <typename Kernels>
const Kernels& kernels_of(const ClusteredSettings& settings, const std::vector<Kernels>& versions) {
    return settings.scalar ? versions.back() : versions.front();
}

/// Time is the number of reads of a frame.
struct ClusteredClock {
    static constexpr std::int64_t never = -1;
    std::int64_t now = 0;              ///< the last read
    std::int64_t answered_at = never;  ///< the read that the last complete answer belongs to
    bool path = false;                 ///< swept, and the last update's frame has a frame before
    double query_distance = 0.0;       ///< query distance of the last update, m
    /// Whether motion at this time is newer than the last answer.
    [[nodiscard]] bool moved(std::int64_t moved_at) const { return moved_at > answered_at; }
};

}  // namespace trocar
