#include "export/exporter.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <set>
#include <system_error>

#include "export/gltf.hpp"
#include "export/paraview.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

/// Every body of every tick as a mesh of its own.
class ObjExporter final : public Exporter {
public:
    ObjExporter(const Topology& topology, std::filesystem::path folder)
        : topology_(&topology), folder_(std::move(folder)) {
        std::set<std::string> taken;
        for (const BodyRange& body : topology.bodies) {
            std::string word = file_word(body.name);
            while (!taken.insert(word).second) word += '_';
            words_.push_back(word);
        }
    }
    void add(const PlayedFrame& frame) override {
        for (std::size_t b = 0; b < words_.size(); ++b) {
            const BodyRange& body = topology_->bodies[b];
            const Triangles triangles = topology_->triangles.middleCols(body.triangles.first, body.triangles.count);
            write_obj(folder_ / fmt::format("{}_{:06}.obj", words_[b], frame.tick),
                      frame.position.middleCols(body.vertices.first, body.vertices.count),
                      triangles.array() - body.vertices.first);
        }
    }
    void finish() override {}

private:
    const Topology* topology_;
    std::filesystem::path folder_;
    std::vector<std::string> words_;
};

}  // namespace

std::unique_ptr<Exporter> make_exporter(ExportFormat format, const Topology& topology, const std::string& name,
                                        const std::filesystem::path& folder) {
    switch (format) {
        case ExportFormat::paraview:
            return paraview_exporter(topology, name, folder);
        case ExportFormat::gltf:
            return gltf_exporter(topology, name, folder);
        case ExportFormat::obj:
            break;
    }
    return std::make_unique<ObjExporter>(topology, folder);
}

UnfinishedFolder::UnfinishedFolder(std::filesystem::path target) : target_(std::move(target)) {
    target_ = std::filesystem::absolute(target_).lexically_normal();
    if (!target_.has_filename()) target_ = target_.parent_path();
    std::error_code error;
    const std::string wanted = "a new or empty folder";
    if (std::filesystem::exists(target_, error)) {
        if (!std::filesystem::is_directory(target_, error)) throw InputError(target_.string(), "", wanted, "a file");
        if (!std::filesystem::is_empty(target_, error)) {
            throw InputError(target_.string(), "", wanted, error ? error.message() : "one that holds something");
        }
    }
    const std::filesystem::path beside = fmt::format("{}.part-{}", target_.string(), getpid());
    std::filesystem::create_directories(beside, error);
    if (error) throw InputError(target_.string(), "", "a folder that can be made", error.message());
    path_ = beside;
}

UnfinishedFolder::~UnfinishedFolder() {
    if (path_.empty()) return;
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

void UnfinishedFolder::keep() {
    std::error_code error;
    std::filesystem::rename(path_, target_, error);
    if (error) throw InputError(target_.string(), "", "a folder that can be made", error.message());
    path_.clear();
}

}  // namespace trocar
