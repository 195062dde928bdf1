// Wavefront OBJ: v and f lines, objects and groups. Lines without geometry (texture, normals, materials) are skipped.
#include <algorithm>
#include <array>

#include "geometry/mesh_text.hpp"

namespace trocar::mesh_text {
namespace {

// Lines without a polygon: vertex attributes, points and lines, free-form attributes, grouping, display.
constexpr std::array<std::string_view, 36> passed_over{
    "vt",         "vn",    "vp",     "vc",        "p",        "l",     "deg",    "bmat",   "step",
    "cstype",     "parm",  "trim",   "hole",      "scrv",     "sp",    "end",    "con",    "s",
    "mg",         "bevel", "usemtl", "c_interp",  "d_interp", "lod",   "mtllib", "usemap", "maplib",
    "shadow_obj", "ctech", "stech",  "trace_obj", "curv",     "curv2", "csh",    "cdc",    "cdp"};
// Lines with a surface that is not made of polygons of this file.
constexpr std::array<std::string_view, 5> other_surfaces{"surf", "call", "bzp", "bsp", "res"};

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& words, std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

/// An index beyond the vertices read so far; valid if they follow.
struct ForwardReference {
    std::int64_t line;
    std::int64_t number;
};

class ObjReader {
public:
    explicit ObjReader(const Source& source) : source_(source), lines_(source.text), builder_(source) {}

    Mesh read() {
        std::string joined;
        std::string_view line;
        std::vector<std::string> ignored;
        while (lines_.next(line)) {
            line_number_ = lines_.line_number();
            if (line.ends_with('\\')) {  // continued on the next line
                joined.assign(line.substr(0, line.size() - 1));
                while (lines_.next(line)) {
                    const bool more = line.ends_with('\\');
                    joined.append(" ").append(line.substr(0, line.size() - (more ? 1 : 0)));
                    if (!more) break;
                }
                line = joined;
            }
            const std::string_view keyword = next_token(line);
            if (keyword.empty()) continue;
            if (keyword == "v") {
                read_vertex(line);
            } else if (keyword == "f" || keyword == "fo") {
                read_face(line);
            } else if (keyword == "o" || keyword == "g") {
                begin_part(keyword == "o" ? objects_ : groups_, line);
            } else if (keyword.front() == '#') {
                builder_.read_unit(keyword);
                builder_.read_unit(line);
            } else if (contains(other_surfaces, keyword)) {
                ignored.push_back("line " + std::to_string(line_number_) + ": " + std::string(keyword));
            } else if (!contains(passed_over, keyword)) {
                fail_line(source_, line_number_, "an OBJ keyword (v, f, vn, g …)", quoted(keyword));
            }
        }
        for (const ForwardReference& reference : forward_) {
            if (reference.number > builder_.vertex_count()) fail_range(reference.line, reference.number);
        }
        Mesh mesh = builder_.finish("obj");
        mesh.ignored = std::move(ignored);
        Parts& parts = objects_.names.empty() ? groups_ : objects_;
        if (!parts.names.empty()) {
            parts.of_triangle.resize(static_cast<std::size_t>(mesh.triangles.cols()), parts.current);
            mesh.objects = std::move(parts.names);
            mesh.object_of_triangle = std::move(parts.of_triangle);
        }
        return mesh;
    }

private:
    /// Objects, or groups, in the order of their first lines; a name that comes again goes on.
    struct Parts {
        std::vector<std::string> names;
        std::vector<Index> of_triangle;  ///< up to the last line
        Index current = -1;
    };

    void begin_part(Parts& parts, std::string_view rest) {
        parts.of_triangle.resize(static_cast<std::size_t>(builder_.triangle_count()), parts.current);
        std::string name(next_token(rest));
        for (std::string_view more = next_token(rest); !more.empty(); more = next_token(rest)) {
            name.append(" ").append(more);
        }
        const auto found = std::find(parts.names.begin(), parts.names.end(), name);
        parts.current = static_cast<Index>(found - parts.names.begin());
        if (found == parts.names.end()) parts.names.push_back(std::move(name));
    }

    void read_vertex(std::string_view rest) {
        std::array<double, 3> p{};
        for (double& coordinate : p) {
            const std::string_view token = next_token(rest);
            if (token.empty() || token.front() == '#') {
                fail_line(source_, line_number_, "three coordinates after v", "fewer");
            }
            coordinate = finite_number(source_, line_number_, token);
        }
        // A weight or a colour may follow.
        for (std::string_view token = next_token(rest); !token.empty() && token.front() != '#';
             token = next_token(rest)) {
            finite_number(source_, line_number_, token);
        }
        builder_.add_vertex(p[0], p[1], p[2]);
    }

    void read_face(std::string_view rest) {
        corners_.clear();
        for (std::string_view token = next_token(rest); !token.empty() && token.front() != '#';
             token = next_token(rest)) {
            corners_.push_back(read_corner(token));
        }
        if (corners_.size() < 3) {
            fail_line(source_, line_number_, "a face of at least 3 corners", std::to_string(corners_.size()));
        }
        builder_.add_polygon(corners_);
    }

    Index read_corner(std::string_view token) {
        const std::optional<std::int64_t> number = parse_integer(token.substr(0, token.find('/')));
        const bool decoration_is_plain = token.find_first_not_of("+-/0123456789") == std::string_view::npos;
        if (!number || !decoration_is_plain)
            fail_line(source_, line_number_, "a vertex number i, i/j, i//k or i/j/k", quoted(token));
        const std::int64_t count = builder_.vertex_count();
        constexpr std::int64_t limit = std::numeric_limits<Index>::max();
        if (*number == 0 || *number < -count || *number > limit) fail_range(line_number_, *number);
        if (*number > count) forward_.push_back({line_number_, *number});
        return static_cast<Index>(*number > 0 ? *number - 1 : count + *number);
    }

    [[noreturn]] void fail_range(std::int64_t line, std::int64_t number) const {
        const std::string count = std::to_string(builder_.vertex_count());
        fail_line(source_, line, number < 0 ? "a vertex number -" + count + " to -1" : "a vertex number 1 to " + count,
                  std::to_string(number));
    }

    const Source& source_;
    LineReader lines_;
    MeshBuilder builder_;
    std::int64_t line_number_ = 0;
    std::vector<Index> corners_;
    Parts objects_;
    Parts groups_;
    std::vector<ForwardReference> forward_;
};

}  // namespace

Mesh read_obj(const Source& source) { return ObjReader(source).read(); }

}  // namespace trocar::mesh_text
