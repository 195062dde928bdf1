// Frames from outside the tick: recorded, or made from a scene by a driver that is no method. Every detector of a
// replay sees the same bits, which the hash over all frames proves.
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
    /// Writes the next frame; false after the last one, and where there can be no other (see outcome).
    virtual bool next(Frame& frame) = 0;
    /// Other than ok once what makes the frames has failed, so that there are fewer than frame_count().
    [[nodiscard]] virtual Outcome outcome() const { return {}; }
};

/// Frames of a recording file. Throws InputError as RecordingReader does.
std::unique_ptr<FrameSource> recorded_frames(const std::filesystem::path& file);

/// Pairs from overlapping boxes and the exact test: the driver's detector, which takes part in no comparison.
std::unique_ptr<Detector> neutral_pairs();

inline constexpr double scene_frames_stiffness = 300.0;  ///< N/m, of the driver's spring per triangle pair

/// Frames 0 … ticks-1 of a scene, as detection would see them. Bodies follow their scripts and operators; tissue is
/// pushed out by a spring per triangle pair, whose pairs come from neutral boxes and the exact test. Deterministic, and
/// no method under comparison takes part: a frame is only an input. Ends early, with an outcome, when the tissue blows
/// up. The scene outlives the source.
std::unique_ptr<FrameSource> scene_frames(const Scene& scene, std::int64_t ticks);

}  // namespace trocar
