#include "fuzz_target.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "geometry/mesh_report.hpp"
#include "geometry/orientation.hpp"

namespace trocar::fuzz {
namespace {

using Json = nlohmann::json;

void write(const std::filesystem::path& file, std::string_view bytes) {
    std::ofstream stream(file, std::ios::binary | std::ios::trunc);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// Of all numbers below: those above 0, by size.
double largest_number(const Json& json) {
    if (json.is_number()) return std::abs(json.get<double>());
    double largest = 0.0;
    if (json.is_structured()) {
        for (const Json& item : json) largest = std::max(largest, largest_number(item));
    }
    return largest;
}

}  // namespace

WorkFolder::WorkFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "trocar-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
    // Studies name scenes as those of the project do.
    std::filesystem::create_directories(path_ / "bench/studies");
    std::filesystem::create_directory_symlink(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes", path_ / "scenes");
    write(path_ / "box.obj",
          "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
          "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
    write(path_ / "sheet.obj",
          "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 0 2 0\nv 1 2 0\nv 2 2 0\n"
          "f 1 2 5 4\nf 2 3 6 5\nf 4 5 8 7\nf 5 6 9 8\n");
}

WorkFolder::~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path as_file(std::string_view input, const std::string& name) {
    static const WorkFolder folder;
    const std::filesystem::path file = folder.path() / name;
    write(file, input);
    return file;
}

int status_with_json(const std::function<int()>& command) {
    const int printed = memfd_create("printed", 0);
    if (printed < 0) throw std::logic_error("no memory file");
    std::fflush(stdout);
    const int kept = dup(STDOUT_FILENO);
    dup2(printed, STDOUT_FILENO);
    const auto restore = [&] {
        std::fflush(stdout);
        dup2(kept, STDOUT_FILENO);
        close(kept);
    };
    int status = 0;
    try {
        status = command();
    } catch (...) {
        restore();
        close(printed);
        throw;
    }
    restore();
    std::string text(static_cast<std::size_t>(lseek(printed, 0, SEEK_END)), '\0');
    const bool whole = pread(printed, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
    close(printed);
    expect(whole && Json::accept(text), "what is printed with --json is one JSON document");
    return status;
}

void read_and_report(Mesh (*read)(const mesh_text::Source&), std::string_view input) {
    Mesh mesh;
    if (!taken([&] { mesh = read({.name = "input", .text = input}); })) return;
    expect(mesh.vertices.allFinite(), "coordinates are finite");
    const Index vertices = static_cast<Index>(mesh.vertices.cols());
    expect(mesh.triangles.size() == 0 || (mesh.triangles.minCoeff() >= 0 && mesh.triangles.maxCoeff() < vertices),
           "triangles name vertices that are there");
    constexpr Eigen::Index most = 200;  // what meets what is asked of every pair
    if (mesh.triangles.cols() > most) return;
    const MeshReport report = report_mesh(mesh);
    expect(report.triangles == mesh.triangles.cols(), "a report counts all triangles");
    const OrientationReport orientation = orientation_of(mesh.vertices, mesh.triangles);
    expect(static_cast<Eigen::Index>(orientation.to_turn.size()) <= mesh.triangles.cols(),
           "a triangle is turned at most once");
    expect(mended(mesh.vertices, mesh.triangles).cols() <= mesh.triangles.cols(), "mending adds no triangle");
}

bool asks_for_much(std::string_view scene) {
    const Json document = Json::parse(scene, nullptr, false);
    if (document.is_discarded() || !document.is_object() || !document.contains("bodies")) return false;
    for (const Json& body : document["bodies"]) {
        if (!body.is_object()) continue;
        const Json tissue = body.value("tissue", Json());
        constexpr double most_substeps = 10.0;
        if (tissue.is_object() && largest_number(tissue.value("substeps", Json())) > most_substeps) return true;
        for (const Json& part : body.value("parts", Json())) {
            if (!part.is_object() || !part.contains("edge")) continue;
            constexpr double most_edges = 40.0;  // along a side
            if (largest_number(part) > most_edges * largest_number(part["edge"])) return true;
        }
    }
    return false;
}

}  // namespace trocar::fuzz
