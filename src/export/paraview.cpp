#include "export/paraview.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "geometry/text.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

/// The array's bytes behind their number, as VTK's inline binary wants them.
template <typename Value>
std::string inline_binary(const Value* values, std::size_t count) {
    const std::uint64_t size = count * sizeof(Value);
    std::string bytes(sizeof size + size, '\0');
    std::memcpy(bytes.data(), &size, sizeof size);
    if (size > 0) std::memcpy(bytes.data() + sizeof size, values, size);
    return base64(bytes);
}

template <typename Value>
std::string array_text(const char* type, const std::string& name, int components, const Value* values,
                       std::size_t count, bool in_field) {
    const std::string tuples =
        in_field ? fmt::format(" NumberOfTuples=\"{}\"", count / static_cast<std::size_t>(components)) : "";
    return fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\"{} format=\"binary\">{}</DataArray>\n", type,
        escape_xml(name), components, tuples, inline_binary(values, count));
}

std::string text_of(const VtkArray& array, bool in_field) {
    if (const auto* reals = std::get_if<std::vector<double>>(&array.values)) {
        return array_text("Float64", array.name, array.components, reals->data(), reals->size(), in_field);
    }
    if (const auto* whole = std::get_if<std::vector<std::int32_t>>(&array.values)) {
        return array_text("Int32", array.name, array.components, whole->data(), whole->size(), in_field);
    }
    const auto& strings = std::get<std::vector<std::string>>(array.values);
    // Strings stand as the numbers of their bytes, each string ended by a zero.
    std::string bytes;
    for (const std::string& text : strings) {
        for (const char letter : text)
            bytes += fmt::format("{} ", static_cast<int>(static_cast<unsigned char>(letter)));
        bytes += "0 ";
    }
    return fmt::format("<Array type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">{}</Array>\n",
                       escape_xml(array.name), strings.size(), bytes);
}

std::string section(const char* tag, const std::vector<VtkArray>& arrays, bool in_field = false) {
    std::string text = fmt::format("<{}>\n", tag);
    for (const VtkArray& array : arrays) text += text_of(array, in_field);
    return text + fmt::format("</{}>\n", tag);
}

/// Connectivity and offsets of cells that all have `corners` points.
std::string cells(const char* tag, const std::vector<std::int64_t>& points, std::size_t corners) {
    std::vector<std::int64_t> ends;
    for (std::size_t end = corners; end <= points.size(); end += corners)
        ends.push_back(static_cast<std::int64_t>(end));
    return fmt::format("<{}>\n", tag) + array_text("Int64", "connectivity", 1, points.data(), points.size(), false) +
           array_text("Int64", "offsets", 1, ends.data(), ends.size(), false) + fmt::format("</{}>\n", tag);
}

void push(const Vector3& vector, std::vector<double>& reals) {
    for (int i = 0; i < 3; ++i) reals.push_back(std::isfinite(vector[i]) ? vector[i] : 0.0);
}

using Reals = std::vector<double>;
using Whole = std::vector<std::int32_t>;
using Strings = std::vector<std::string>;

class ParaviewExporter final : public Exporter {
public:
    ParaviewExporter(const Topology& topology, const std::string& name, std::filesystem::path folder)
        : topology_(&topology), word_(file_word(name)), folder_(std::move(folder)) {
        for (const BodyRange& body : topology.bodies) body_names_.push_back(body.name);
        vertex_body_.resize(static_cast<std::size_t>(topology.vertex_count));
        for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
            const Range& vertices = topology.bodies[b].vertices;
            std::fill_n(vertex_body_.begin() + vertices.first, vertices.count, static_cast<std::int32_t>(b));
        }
    }

    void add(const PlayedFrame& frame) override {
        write_whole(folder_ / file_of("bodies", frame.tick), bodies(frame));
        write_whole(folder_ / file_of("contacts", frame.tick), contacts(frame));
        time_of_tick_[frame.tick] = frame.time;
    }

    void finish() override {
        std::string text =
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
            "<Collection>\n";
        for (const auto& [tick, time] : time_of_tick_) {
            int part = 0;
            for (const char* what : {"bodies", "contacts"}) {
                text += fmt::format("<DataSet timestep=\"{}\" group=\"\" part=\"{}\" name=\"{}\" file=\"{}\"/>\n", time,
                                    part++, what, file_of(what, tick));
            }
        }
        write_whole(folder_ / (word_ + ".pvd"), text + "</Collection>\n</VTKFile>\n");
    }

private:
    [[nodiscard]] std::string file_of(const char* what, std::int64_t tick) const {
        return fmt::format("{}_{}_{:06}.vtp", word_, what, tick);
    }

    [[nodiscard]] std::string bodies(const PlayedFrame& frame) const {
        VtkPolyData data;
        data.points = frame.position;
        data.triangles = topology_->triangles;
        const Matrix3X& path = frame.displacement;
        data.at_points = {
            {.name = "depth", .values = frame.depth},
            {.name = "strain", .values = frame.strain},
            {.name = "displacement", .components = 3, .values = Reals(path.data(), path.data() + path.size())},
            {.name = "body", .values = vertex_body_}};
        const std::vector<Index>& body = topology_->body_of_triangle;
        data.at_cells = {{.name = "body", .values = Whole(body.begin(), body.end())}};
        Whole tool;
        Reals force;
        Reals moment;
        for (const PlayedTool& one : frame.tools) {
            tool.push_back(one.body);
            push(one.force, force);
            push(one.moment, moment);
        }
        data.field = {{.name = "body_names", .values = body_names_},
                      {.name = "tool_body", .values = tool},
                      {.name = "tool_force", .components = 3, .values = force},
                      {.name = "tool_moment", .components = 3, .values = moment}};
        return to_vtp(data);
    }

    [[nodiscard]] std::string contacts(const PlayedFrame& frame) const {
        VtkPolyData data;
        data.points_are_cells = true;
        data.points.resize(3, static_cast<Eigen::Index>(frame.contacts.size()));
        Reals normal;
        Reals force;
        Reals depth;
        Whole reported;
        Whole kind;
        Whole body;
        Whole other;
        Eigen::Index column = 0;
        for (const PlayedContact& contact : frame.contacts) {
            data.points.col(column++) = contact.point;
            push(contact.normal, normal);
            push(contact.force, force);
            depth.push_back(std::isfinite(contact.depth) ? contact.depth : 0.0);
            reported.push_back(contact.force.allFinite() ? 1 : 0);
            kind.push_back(static_cast<std::int32_t>(contact.kind));
            body.push_back(contact.body);
            other.push_back(contact.other);
        }
        data.at_points = {{.name = "normal", .components = 3, .values = normal},
                          {.name = "force", .components = 3, .values = force},
                          {.name = "depth", .values = depth},
                          {.name = "force_reported", .values = reported},
                          {.name = "kind", .values = kind},
                          {.name = "body", .values = body},
                          {.name = "other", .values = other}};
        Strings kinds;
        for (const ActingKind one :
             {ActingKind::found, ActingKind::pushed, ActingKind::held_force, ActingKind::placed}) {
            kinds.emplace_back(name_of(one));
        }
        data.field = {{.name = "body_names", .values = body_names_}, {.name = "kind_names", .values = kinds}};
        return to_vtp(data);
    }

    const Topology* topology_;
    std::string word_;
    std::filesystem::path folder_;
    Strings body_names_;
    Whole vertex_body_;                            ///< per vertex
    std::map<std::int64_t, double> time_of_tick_;  ///< s
};

}  // namespace

std::string to_vtp(const VtkPolyData& data) {
    std::vector<std::int64_t> points;
    if (data.points_are_cells) {
        for (Eigen::Index i = 0; i < data.points.cols(); ++i) points.push_back(i);
    }
    const std::vector<std::int64_t> corners(data.triangles.data(), data.triangles.data() + data.triangles.size());
    return fmt::format(
               "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
               "header_type=\"UInt64\">\n<PolyData>\n") +
           section("FieldData", data.field, true) +
           fmt::format(
               "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
               "NumberOfPolys=\"{}\">\n",
               data.points.cols(), points.size(), data.triangles.cols()) +
           section("PointData", data.at_points) + section("CellData", data.at_cells) + "<Points>\n" +
           array_text("Float64", "Points", 3, data.points.data(), static_cast<std::size_t>(data.points.size()), false) +
           "</Points>\n" + cells("Verts", points, 1) + cells("Polys", corners, 3) +
           "</Piece>\n</PolyData>\n</VTKFile>\n";
}

std::unique_ptr<Exporter> paraview_exporter(const Topology& topology, const std::string& name,
                                            const std::filesystem::path& folder) {
    return std::make_unique<ParaviewExporter>(topology, name, folder);
}

}  // namespace trocar
