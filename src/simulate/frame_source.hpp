// Frames from outside the tick: recorded, or made from a scene by a neutral driver. Every detector of a replay reads
// the same bits; a hash over all frames verifies it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "method/detector.hpp"
#include "scene/scene.hpp"

namespace trocar {

class FrameSource {
public:
    FrameSource() = default;
    FrameSource(const FrameSource&) = delete;
    FrameSource& operator=(const FrameSource&) = delete;
    FrameSource(FrameSource&&) = delete;
    FrameSource& operator=(FrameSource&&) = delete;
    virtual ~FrameSource() = default;

    [[nodiscard]] virtual const Topology& topology() const = 0;
    [[nodiscard]] virtual double dt() const = 0;  ///< s
    [[nodiscard]] virtual std::int64_t frame_count() const = 0;
    /// Writes the next frame. Returns false after the last frame and after a failure (see outcome).
    virtual bool next(Frame& frame) = 0;
    /// Not ok after a failure of the generator; there are then fewer than frame_count() frames.
    [[nodiscard]] virtual Outcome outcome() const { return {}; }
};

/// Frames of a recording file. Throws InputError as RecordingReader does.
std::unique_ptr<FrameSource> recorded_frames(const std::filesystem::path& file);

/// The driver's detector: overlapping boxes and the exact test. It takes part in no comparison.
std::unique_ptr<Detector> neutral_pairs();

inline constexpr double scene_frames_stiffness = 300.0;  ///< N/m, of the driver's spring per triangle pair

/// Frames 0 … ticks-1 of a scene, as detection reads them. Bodies follow their scripts and operators. One penalty
/// spring per triangle pair of neutral_pairs() pushes tissue out. Deterministic and independent of every compared
/// method. Ends early, with an outcome, when a step fails. The scene outlives the source.
std::unique_ptr<FrameSource> scene_frames(const Scene& scene, std::int64_t ticks);

}  // namespace trocar
