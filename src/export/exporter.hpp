// Played frames as files of other programs: ParaView's XML, glTF 2.0, OBJ. The output is one folder, which appears
// complete or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "playback/playback.hpp"
#include "scene/world.hpp"

namespace trocar {

enum class ExportFormat : std::uint8_t { paraview, gltf, obj };

/// Largest number of morph targets of a glTF animation. The first frame is the mesh itself and adds one frame.
inline constexpr std::int64_t most_morph_targets = 64;

/// Largest number of frames of a format; 0: any number.
constexpr std::int64_t most_frames(ExportFormat format) {
    return format == ExportFormat::gltf ? most_morph_targets + 1 : 0;
}

class Exporter {
public:
    Exporter() = default;
    Exporter(const Exporter&) = delete;
    Exporter& operator=(const Exporter&) = delete;
    Exporter(Exporter&&) = delete;
    Exporter& operator=(Exporter&&) = delete;
    virtual ~Exporter() = default;

    /// In any order of ticks, every tick once. Throws InputError on a write error.
    virtual void add(const PlayedFrame& frame) = 0;
    /// Call after the last frame; at least one was added.
    virtual void finish() = 0;
};

/// Writes into an existing folder; files begin with `name`. The topology outlives the object.
std::unique_ptr<Exporter> make_exporter(ExportFormat format, const Topology& topology, const std::string& name,
                                        const std::filesystem::path& folder);

/// Folder under a temporary name until keep(); the destructor removes a folder that is not kept.
class UnfinishedFolder {
public:
    /// Throws InputError unless `target` is missing or an empty folder, and on a write error.
    explicit UnfinishedFolder(std::filesystem::path target);
    ~UnfinishedFolder();
    UnfinishedFolder(const UnfinishedFolder&) = delete;
    UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;
    UnfinishedFolder(UnfinishedFolder&&) = delete;
    UnfinishedFolder& operator=(UnfinishedFolder&&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// Renames the folder to `target`.
    void keep();

private:
    std::filesystem::path target_;
    std::filesystem::path path_;
};

}  // namespace trocar
