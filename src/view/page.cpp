#include "view/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/text.hpp"
#include "view/pack.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;

struct Extent {
    Vector3 low = Vector3::Zero();
    Vector3 high = Vector3::Zero();
};

/// The box of all frames, at most three times that of the scene at rest: what a blown-up run throws further away would
/// only cost all others their precision.
Extent box_of(const ViewPage& page) {
    if (page.rest.cols() == 0) return {};
    Extent box{page.rest.rowwise().minCoeff(), page.rest.rowwise().maxCoeff()};
    const double far = (box.high - box.low).norm();
    const Vector3 lowest = box.low.array() - far;
    const Vector3 highest = box.high.array() + far;
    for (const ViewedRun& run : page.runs) {
        for (const ViewedFrame& frame : run.frames) {
            box.low = box.low.cwiseMin(frame.position.rowwise().minCoeff()).cwiseMax(lowest);
            box.high = box.high.cwiseMax(frame.position.rowwise().maxCoeff()).cwiseMin(highest);
        }
    }
    return box;
}

/// Values 0 … largest as bytes 0 … 255; anything above 0 is at least 1, so that no depth is painted as none.
void add_bytes(const std::vector<double>& values, double largest, std::string& bytes) {
    for (const double value : values) {
        const double part = largest > 0.0 ? std::clamp(value / largest, 0.0, 1.0) : 0.0;
        bytes +=
            static_cast<char>(static_cast<unsigned char>(value > 0.0 ? std::max(1.0, std::round(255.0 * part)) : 0.0));
    }
}

std::vector<float> floats(const std::vector<double>& values) { return {values.begin(), values.end()}; }

Json worst_json(const LargestValue& worst) { return {{"tick", worst.tick}, {"value", worst.value}}; }

Json run_json(const ViewedRun& run, const std::vector<const ViewedFrame*>& frames, const Quantiser& quantiser,
              const std::vector<std::uint16_t>& rest) {
    constexpr double most = 32767.0;
    const double force_step = run.contact_force_max > 0.0 ? run.contact_force_max / most : 1.0;
    std::vector<std::int64_t> ticks;
    std::vector<std::vector<std::uint16_t>> positions;
    std::string depth;
    std::string strain;
    std::vector<std::size_t> counts;
    std::vector<std::uint16_t> points;
    std::vector<std::int16_t> forces;
    std::vector<std::uint16_t> tool_points;
    constexpr std::uint16_t nowhere = 65535;  // no coordinate is as large
    for (const ViewedFrame* frame : frames) {
        ticks.push_back(frame->tick);
        positions.push_back(quantised(frame->position, quantiser));
        add_bytes(frame->depth, run.depth_max, depth);
        add_bytes(frame->strain, run.strain_max, strain);
        counts.push_back(frame->contacts.size());
        for (int axis = 0; axis < 3; ++axis) {
            tool_points.push_back(frame->tool_point.allFinite() ? quantiser.number(frame->tool_point[axis], axis)
                                                                : nowhere);
        }
        for (const ViewedContact& contact : frame->contacts) {
            for (int axis = 0; axis < 3; ++axis) {
                points.push_back(quantiser.number(contact.point[axis], axis));
                const double steps = std::round(contact.force[axis] / force_step);
                forces.push_back(static_cast<std::int16_t>(std::clamp(steps, -most, most)));
            }
        }
    }
    std::vector<float> force;
    for (const Vector3& one : run.force) {
        for (const double part : {one.x(), one.y(), one.z()}) force.push_back(static_cast<float>(part));
    }
    const std::vector<float> contacts(run.contacts.begin(), run.contacts.end());
    return {{"label", run.label},
            {"methods", run.methods},
            {"outcome", run.outcome},
            {"message", run.message},
            {"note", run.note},
            {"frames", ticks},
            {"positions", deflated(frame_bytes(positions, rest))},
            {"depth", {{"max", run.depth_max}, {"values", deflated(depth)}}},
            {"strain", {{"max", run.strain_max}, {"values", deflated(strain)}}},
            {"displacement", {{"max", run.displacement_max}}},
            {"contacts_per_frame", counts},
            {"points", deflated_numbers(points)},
            {"forces", deflated_numbers(forces)},
            {"tool_points", deflated_numbers(tool_points)},
            {"force_step", force_step},
            {"contact_force_max", run.contact_force_max},
            {"curves",
             {{"force", deflated_numbers(force)},
              {"depth", deflated_numbers(floats(run.depth))},
              {"contacts", deflated_numbers(contacts)}}},
            {"worst", {{"depth", worst_json(run.worst_depth)}, {"force", worst_json(run.worst_force)}}}};
}

Json bodies_json(const Topology& topology) {
    Json bodies = Json::array();
    for (const BodyRange& body : topology.bodies) {
        bodies.push_back({{"name", body.name},
                          {"kind", body_kind_words.at(static_cast<std::size_t>(body.kind))},
                          {"closed", body.closed},
                          {"vertices", {body.vertices.first, body.vertices.count}},
                          {"triangles", {body.triangles.first, body.triangles.count}}});
    }
    return bodies;
}

/// The frames that are left when only every `thin`-th of the regular ones stays.
std::vector<const ViewedFrame*> thinned(const ViewedRun& run, std::size_t thin) {
    std::vector<const ViewedFrame*> frames;
    for (std::size_t k = 0; k < run.frames.size(); ++k) {
        const ViewedFrame& frame = run.frames[k];
        const bool must =
            frame.tick == run.worst_depth.tick || frame.tick == run.worst_force.tick || k + 1 == run.frames.size();
        if (must || k % thin == 0) frames.push_back(&frame);
    }
    return frames;
}

/// Without "<", which could end the element that holds it or begin a comment.
std::string for_script(const Json& json) {
    std::string text;
    for (const char letter : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
        if (letter == '<') {
            text += "\\u003c";
        } else {
            text += letter;
        }
    }
    return text;
}

std::string data_json(const ViewPage& page, std::size_t thin, const std::string& foot) {
    const Extent box = box_of(page);
    const Quantiser quantiser(box.low, box.high);
    const std::vector<std::uint16_t> rest = quantised(page.rest, quantiser);
    const std::vector<std::uint16_t> nothing(rest.size(), 0);
    std::vector<std::uint32_t> triangles;
    for (Index t = 0; t < page.topology.triangle_count(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            triangles.push_back(static_cast<std::uint32_t>(page.topology.triangles(corner, t)));
        }
    }
    Json runs = Json::array();
    std::vector<std::string> notes = page.notes;
    for (const ViewedRun& run : page.runs) {
        const std::vector<const ViewedFrame*> frames = thinned(run, thin);
        runs.push_back(run_json(run, frames, quantiser, rest));
        const bool outside = std::any_of(frames.begin(), frames.end(), [&](const ViewedFrame* frame) {
            for (Index vertex = 0; vertex < static_cast<Index>(frame->position.cols()); ++vertex) {
                if (!quantiser.holds(frame->position.col(vertex))) return true;
            }
            return false;
        });
        if (outside) {
            notes.push_back(
                fmt::format("{}: some vertices fly further away than is drawn; they are shown at the "
                            "border of the picture",
                            run.label));
        }
    }
    Json references = Json::array();
    for (const ViewedReference& reference : page.references) {
        references.push_back({{"name", reference.name},
                              {"solid", reference.solid},
                              {"force", deflated_numbers(floats(reference.force))}});
    }
    const auto three = [](const Vector3& v) { return Json{v.x(), v.y(), v.z()}; };
    const Json tool = page.tool_vertex < 0 ? Json(nullptr) : Json{{"vertex", page.tool_vertex}};
    return for_script({{"format", "trocar-view-1"},
                       {"scene", page.scene},
                       {"about", page.about},
                       {"foot", foot},
                       {"notes", notes},
                       {"dt", page.dt},
                       {"ticks", page.ticks},
                       {"vertices", page.topology.vertex_count},
                       {"tissue_vertices", tissue_vertices(page.topology).size()},
                       {"low", three(quantiser.low())},
                       {"step", three(quantiser.step())},
                       {"bodies", bodies_json(page.topology)},
                       {"triangles", deflated_numbers(triangles)},
                       {"rest", deflated(frame_bytes({rest}, nothing))},
                       {"tool", tool},
                       {"references", references},
                       {"runs", runs}});
}

std::int64_t largest_gap(const ViewPage& page, std::size_t thin) {
    std::int64_t gap = 1;
    for (const ViewedRun& run : page.runs) {
        const std::vector<const ViewedFrame*> frames = thinned(run, thin);
        for (std::size_t k = 1; k < frames.size(); ++k) gap = std::max(gap, frames[k]->tick - frames[k - 1]->tick);
    }
    return gap;
}

}  // namespace

double view_error_bound(const ViewPage& page) {
    const Extent box = box_of(page);
    return 0.5 * Quantiser(box.low, box.high).step().maxCoeff();
}

std::string view_html(const ViewPage& page, const std::string& script, std::size_t budget) {
    std::size_t frames = 1;
    for (const ViewedRun& run : page.runs) frames = std::max(frames, run.frames.size());
    std::string data;
    for (std::size_t thin = 1;; thin *= 2) {
        const std::string foot = fmt::format(
            "Numbers and curves: every tick. Picture: every {} ticks, the worst and the last one, "
            "coordinates to {:.2g} mm. {}",
            largest_gap(page, thin), 1e3 * view_error_bound(page), page.foot);
        data = data_json(page, thin, foot);
        if (data.size() <= budget || thin >= frames) break;
    }
    const std::string code = script.empty() ? fmt::format("<script>{}</script>", web::viewer_script())
                                            : fmt::format("<script src=\"{}\"></script>", escape_xml(script));
    // Whatever is in the page, it loads nothing from outside: neither by mistake nor by a name that somebody chose.
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline' 'self' "
        "file:; style-src 'unsafe-inline'; img-src data: blob:\">\n"
        "<title>{} · trocar</title>\n</head>\n<body>\n"
        "<noscript>This page needs JavaScript.</noscript>\n"
        "<script id=\"trocar-view\" type=\"application/json\">{}</script>\n{}\n</body>\n</html>\n",
        escape_xml(page.scene), data, code);
}

}  // namespace trocar
