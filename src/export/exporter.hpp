// Played frames as files of other programs: ParaView's XML, glTF 2.0, OBJ. All that is written lies in one folder that
// is there as a whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "playback/playback.hpp"
#include "scene/world.hpp"

namespace trocar {

enum class ExportFormat : std::uint8_t { paraview, gltf, obj };

/// Most morph targets of a glTF animation; with the first frame, which is the mesh itself, one more frame than that.
inline constexpr std::int64_t most_morph_targets = 64;

/// Most frames that a format takes; 0: any number.
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

    /// In any order of ticks, every tick once. Throws InputError when the disk refuses.
    virtual void add(const PlayedFrame& frame) = 0;
    /// After the last frame; at least one was added.
    virtual void finish() = 0;
};

/// Writes into an existing folder; files begin with `name`. The topology outlives the object.
std::unique_ptr<Exporter> make_exporter(ExportFormat format, const Topology& topology, const std::string& name,
                                        const std::filesystem::path& folder);

/// A folder under another name until keep(): what is not kept is removed again.
class UnfinishedFolder {
public:
    /// Throws InputError unless `target` is missing or an empty folder, and when the disk refuses.
    explicit UnfinishedFolder(std::filesystem::path target);
    ~UnfinishedFolder();
    UnfinishedFolder(const UnfinishedFolder&) = delete;
    UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;
    UnfinishedFolder(UnfinishedFolder&&) = delete;
    UnfinishedFolder& operator=(UnfinishedFolder&&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// Gives it its name.
    void keep();

private:
    std::filesystem::path target_;
    std::filesystem::path path_;
};

}  // namespace trocar
