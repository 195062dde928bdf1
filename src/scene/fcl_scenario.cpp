// Reads a scenario of FCL's test models: <OBJECT> elements with <GRID> vertices and <TRIA> triangles, then <FRAME>
// elements with a position and direction cosines (row by row) of each object.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>

#include "geometry/input_error.hpp"
#include "geometry/mesh_text.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "scene/external_frames.hpp"
#include "scene/mesh_pair.hpp"

namespace trocar {
namespace {

constexpr std::string_view tag_blanks = " \t\r\n";

/// One element, from < to >, with its attributes.
struct ScenarioTag {
    std::string_view name;
    std::map<std::string_view, std::string_view> attributes;
    std::int64_t line = 0;
};

class ScenarioText {
public:
    explicit ScenarioText(const mesh_text::Source& source) : source_(source) {}

    /// False at the end of the text.
    bool next(ScenarioTag& tag) {
        const std::size_t begin = source_.text.find('<', position_);
        if (begin == std::string_view::npos) return false;
        line_ += count_lines(position_, begin);
        const std::size_t end = source_.text.find('>', begin);
        if (end == std::string_view::npos) mesh_text::fail_line(source_, line_, "> at the end of an element", "none");
        read(source_.text.substr(begin + 1, end - begin - 1), tag);
        line_ += count_lines(begin, end);
        position_ = end + 1;
        return true;
    }

private:
    [[nodiscard]] std::int64_t count_lines(std::size_t begin, std::size_t end) const {
        const auto text = source_.text.substr(begin, end - begin);
        return std::count(text.begin(), text.end(), '\n');
    }

    void read(std::string_view text, ScenarioTag& tag) const {
        tag.line = line_;
        tag.attributes.clear();
        const std::size_t name_end = std::min(text.find_first_of(tag_blanks), text.size());
        tag.name = text.substr(0, name_end);
        std::size_t place = text.find_first_not_of(tag_blanks, name_end);
        while (place != std::string_view::npos && text[place] != '/') {
            const std::size_t equals = text.find("=\"", place);
            const std::size_t end = equals == std::string_view::npos ? equals : text.find('"', equals + 2);
            if (end == std::string_view::npos) {
                mesh_text::fail_line(source_, line_, "NAME=\"VALUE\"", mesh_text::quoted(text.substr(place)));
            }
            tag.attributes[text.substr(place, equals - place)] = text.substr(equals + 2, end - equals - 2);
            place = text.find_first_not_of(tag_blanks, end + 1);
        }
    }

    const mesh_text::Source& source_;
    std::size_t position_ = 0;
    std::int64_t line_ = 1;
};

/// The finite numbers of an attribute.
template <std::size_t Count>
std::array<double, Count> attribute_numbers(const mesh_text::Source& source, const ScenarioTag& tag,
                                            std::string_view name) {
    const auto found = tag.attributes.find(name);
    if (found == tag.attributes.end()) {
        mesh_text::fail_line(source, tag.line, fmt::format("{}=\"…\" in <{}>", name, tag.name), "none");
    }
    std::array<double, Count> numbers{};
    std::string_view rest = found->second;
    for (double& number : numbers) number = mesh_text::finite_number(source, tag.line, mesh_text::next_token(rest));
    if (!mesh_text::next_token(rest).empty()) {
        mesh_text::fail_line(source, tag.line, fmt::format("{} numbers in {}", Count, name), "more");
    }
    return numbers;
}

/// A whole number of an attribute, from 1 to `most`, counted from 0.
Index attribute_number(const mesh_text::Source& source, const ScenarioTag& tag, std::string_view name,
                       std::int64_t most) {
    const auto found = tag.attributes.find(name);
    const std::string_view text = found == tag.attributes.end() ? std::string_view() : found->second;
    const std::optional<std::int64_t> number = mesh_text::parse_integer(text);
    if (!number || *number < 1 || *number > most) {
        mesh_text::fail_line(source, tag.line, fmt::format("a number from 1 to {} as {}", most, name),
                             mesh_text::quoted(text));
    }
    return static_cast<Index>(*number - 1);
}

struct ScenarioPose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Vector3 translation = Vector3::Zero();
};

ScenarioPose pose_in(const mesh_text::Source& source, const ScenarioTag& tag, const std::string& object) {
    const std::array<double, 3> place = attribute_numbers<3>(source, tag, object + "_pos");
    const std::array<double, 9> cosines = attribute_numbers<9>(source, tag, object + "_dc");
    ScenarioPose pose;
    for (std::size_t i = 0; i < 3; ++i) {
        pose.translation[static_cast<Eigen::Index>(i)] = place.at(i);
        for (std::size_t j = 0; j < 3; ++j) {
            pose.rotation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = cosines.at(3 * i + j);
        }
    }
    return pose;
}

Matrix3X placed(const Matrix3X& vertices, const ScenarioPose& pose) {
    return (pose.rotation * vertices).colwise() + pose.translation;
}

}  // namespace

ExternalFrames read_fcl_scenario(const std::filesystem::path& file) {
    const std::string text = read_whole(file, "a scenario of FCL's test models");
    const mesh_text::Source source{file.string(), text};
    std::vector<mesh_text::MeshBuilder> builders;
    std::vector<std::array<ScenarioPose, 2>> poses;
    ScenarioText tags(source);
    for (ScenarioTag tag; tags.next(tag);) {
        const bool in_object = tag.name == "GRID" || tag.name == "TRIA";
        if (in_object && builders.empty()) mesh_text::fail_line(source, tag.line, "<OBJECT> before it", "none");
        if (tag.name == "OBJECT") {
            builders.emplace_back(source);
        } else if (tag.name == "GRID") {
            const auto next = builders.back().vertex_count() + 1;
            if (attribute_number(source, tag, "id", next) + 1 != next) {
                mesh_text::fail_line(source, tag.line, fmt::format("id {}, in order", next), "another");
            }
            builders.back().add_vertex(attribute_numbers<1>(source, tag, "x")[0],
                                       attribute_numbers<1>(source, tag, "y")[0],
                                       attribute_numbers<1>(source, tag, "z")[0]);
        } else if (tag.name == "TRIA") {
            const std::int64_t most = builders.back().vertex_count();
            builders.back().add_triangle(attribute_number(source, tag, "g1", most),
                                         attribute_number(source, tag, "g2", most),
                                         attribute_number(source, tag, "g3", most));
        } else if (tag.name == "FRAME") {
            poses.push_back({pose_in(source, tag, "obj1"), pose_in(source, tag, "obj2")});
        }
    }
    if (builders.size() != 2) {
        throw InputError(source.name, "", "two <OBJECT> elements", fmt::format("{}", builders.size()));
    }
    if (poses.empty()) throw InputError(source.name, "", "at least one <FRAME>", "none");
    const std::int64_t points = builders[0].vertex_count() + builders[1].vertex_count();
    if (are_sizes_limited() && static_cast<std::int64_t>(poses.size()) * points > most_vertices) {
        throw InputError(source.name, "", limit_text(most_vertices, "vertices of all poses"),
                         fmt::format("{} poses of {}", poses.size(), points));
    }
    const Mesh a = builders[0].finish("fcl");
    const Mesh b = builders[1].finish("fcl");
    MeshPair pair = make_mesh_pair(a, b);
    ExternalFrames result;
    result.topology = std::move(pair.topology);
    for (const auto& [pose_a, pose_b] : poses) {
        Frame frame = pair.frame;
        frame.position << placed(a.vertices, pose_a), placed(b.vertices, pose_b);
        frame.previous = frame.position;
        frame.tick = static_cast<std::int64_t>(result.frames.size());
        frame.time = static_cast<double>(frame.tick);
        result.frames.push_back(std::move(frame));
    }
    return result;
}

}  // namespace trocar
