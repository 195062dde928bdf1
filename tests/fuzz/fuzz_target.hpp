// What the fuzz targets share. A target is one function over bytes: it reads them as the program would, and the one way
// it may end otherwise than well is a refusal, InputError with one clean line. Everything else that it throws, and
// everything that a sanitizer reports, is a find.
#pragma once

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/mesh_text.hpp"

namespace trocar::fuzz {

void mesh_obj(std::string_view input);
void mesh_off(std::string_view input);
void mesh_ply(std::string_view input);
void mesh_stl(std::string_view input);
void mesh_vrml(std::string_view input);
void mesh_vtk(std::string_view input);
void mesh_vtp(std::string_view input);
void frames(std::string_view input);
void scene(std::string_view input);
void study(std::string_view input);
void recording(std::string_view input);
void replay(std::string_view input);
void baseline(std::string_view input);
void response_cases(std::string_view input);
void pairs(std::string_view input);
void external_data(std::string_view input);
void lines(std::string_view input);
void record(std::string_view input);
void report(std::string_view input);
void shard(std::string_view input);
void run(std::string_view input);

/// Throws std::logic_error: what was read is not what its reader promises.
inline void expect(bool holds, const std::string& promise) {
    if (!holds) throw std::logic_error("broken promise: " + promise);
}

/// What this process puts its inputs into for readers that want a file: a folder in $TMPDIR (in memory, where that is)
/// with the small meshes box.obj and sheet.obj and a link to the scenes of the project.
class WorkFolder {
public:
    WorkFolder();
    ~WorkFolder();
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    WorkFolder(WorkFolder&&) = delete;
    WorkFolder& operator=(WorkFolder&&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

/// The input as a file of that name in the folder of this process; it lasts until the next one of that name.
std::filesystem::path as_file(std::string_view input, const std::string& name);

/// Calls `read`; false when it refused its input.
template <typename Read>
bool taken(const Read& read) {
    try {
        read();
        return true;
    } catch (const InputError& error) {
        constexpr std::size_t longest = 400;
        const std::string_view line = error.what();
        expect(!line.empty() && line.size() <= longest && printable_line(line) == line, "a refusal is one clean line");
        return false;
    }
}

/// Calls a command of the program, gives its exit status, and expects that what it prints is one JSON document.
int status_with_json(const std::function<int()>& command);

/// Reads a mesh and examines what was read as `trocar mesh` does.
void read_and_report(Mesh (*read)(const mesh_text::Source&), std::string_view input);

/// True when the scene asks for shapes of some ten thousand triangles or more, or for many sub-steps: valid, and no use
/// in a test that wants thousands of inputs a second. What limits sizes has tests of its own.
bool asks_for_much(std::string_view scene);

}  // namespace trocar::fuzz
