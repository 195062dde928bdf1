// ODE 0.16, trimesh against trimesh (OPCODE trees): one trimesh per body, each listed body pair collided once a tick.
//
// Settings, and where they depart from the library's defaults (measured facts in README.md):
//  dCollide directly  no space: after dGeomTriMeshDataUpdate the box that a space culls by stays at the old place.
//  update             dGeomTriMeshDataUpdate, which refits the tree; vertices are referenced, not copied, so they are
//                     kept here as doubles with a stride of 24 bytes. `rebuild` builds the data anew.
//  contacts           the cap is the low 16 bits of the flags: 65535, the largest, so that nothing is cut off.
//                     CONTACTS_UNIMPORTANT stays off.
//  temporal coherence off (default); it exists for sphere, box and capsule only.
//  messages           silenced, since they are printed in the middle of a query.
//  one triangle       a trimesh of a single triangle is missed or crashes: it gets a second one far away, whose hits
//                     are dropped.
// Inside, OPCODE narrows all coordinates to float32, in the double-precision build too.
//
// What its pairs mean: ODE has no list of intersecting triangles. Its trimesh collider finds them all (OPCODE's pair
// list), makes contacts of each, and merges contacts of different pairs that lie within 1e-4 of a length unit: averaged
// when their depths agree within 1e-5 units, else only the deeper one stays. The merge callbacks, installed on both
// meshes, still report the triangles of an averaged contact, and they are counted as pairs; a replaced or dropped
// contact is made to nobody, and a pair all of whose contacts fared so is lost. Most are at one point: a vertex below a
// plane is the deepest point of every triangle around it. Other callbacks (dGeomTriMeshSetCallback, …SetArrayCallback)
// are called for trimeshes against primitives only, and OPCODE's list has no public way out.
//  merge      as_is (default): one trimesh per body, as ODE's users have it. none: no pair is lost; each body becomes
//             trimeshes whose triangles share no vertex (some seven to ten, greedy colouring), since contacts are
//             merged within one dCollide only. The trees together are as large as before, the calls are some fifty
//             times as many: the price of ODE as a detector of pairs.
//  scale      factor from metres to the unit that ODE sees, since all of this is absolute. The default, millimetres,
//             loses least without inventing pairs: on six generated scenes 0.85 to 1.00 of the true pairs, in metres
//             0.83 to 1.00, from 1e5 units a metre upwards and from 0.1 downwards with wrong pairs.
// Native contacts: points and depths against infinite planes; the normal points into the first geom in ODE and is
// turned here, so that it points from the first body to the second. Merged contacts have no triangle (-1).
#include <fmt/format.h>
#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "candidates.hpp"
#include "geometry/input_error.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"
#include "ode_library.hpp"

namespace trocar {
namespace {

constexpr int most_contacts = 65535;

/// The triangles of a merged contact come one after the other: first mesh, then second.
struct MergeLog {
    dGeomID first_geom = nullptr;
    int first = -1;
    std::vector<std::array<int, 2>> pairs;
};
thread_local MergeLog merge_log;

/// Called by ODE for each mesh of a contact that takes up a further triangle pair; the returned number becomes the
/// contact's triangle, -1 as without a callback.
int note_merge(dGeomID geom, int /*triangle_so_far*/, int triangle) {
    if (geom == merge_log.first_geom) {
        merge_log.first = triangle;
    } else {
        merge_log.pairs.push_back({merge_log.first, triangle});
    }
    return -1;
}

/// Some of a body's triangles, or all.
struct Mesh {
    std::vector<std::uint32_t> indices;
    std::vector<Index> triangles;  ///< numbers in the topology, without the far one
    dTriMeshDataID data = nullptr;
    dGeomID geom = nullptr;
    [[nodiscard]] int triangle_count() const { return static_cast<int>(triangles.size()); }

    Mesh() = default;
    Mesh(const Mesh&) = delete;
    Mesh& operator=(const Mesh&) = delete;
    Mesh(Mesh&&) = delete;
    Mesh& operator=(Mesh&&) = delete;
    ~Mesh() {
        if (geom != nullptr) dGeomDestroy(geom);
        if (data != nullptr) dGeomTriMeshDataDestroy(data);
    }
};

/// One body as ODE sees it.
struct MeshBody {
    std::vector<double> vertices;  ///< 3 per vertex, in ODE's unit; three more for a far triangle where one is needed
    std::vector<std::unique_ptr<Mesh>> meshes;
    Index near_triangle = 0;  ///< vertices of the far triangle are a copy of this one's, moved
    bool padded = false;
};

struct Settings {
    double scale = 1000.0;
    bool refit = true;
    bool split = false;
};

/// Groups of a body's triangles, none of which share a vertex: each goes to the first group that its corners allow.
std::vector<std::vector<Index>> without_common_vertices(const Topology& topology, const BodyRange& body) {
    std::vector<std::vector<Index>> groups;
    std::vector<std::vector<bool>> taken(static_cast<std::size_t>(body.vertices.count));
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        std::array<std::vector<bool>*, 3> corners{};
        for (int k = 0; k < 3; ++k) {
            corners.at(static_cast<std::size_t>(k)) =
                &taken[static_cast<std::size_t>(topology.triangles(k, t) - body.vertices.first)];
        }
        std::size_t group = 0;
        const auto is_taken = [&group](const std::vector<bool>* corner) {
            return group < corner->size() && (*corner)[group];
        };
        while (std::any_of(corners.begin(), corners.end(), is_taken)) ++group;
        for (std::vector<bool>* corner : corners) {
            if (corner->size() <= group) corner->resize(group + 1);
            (*corner)[group] = true;
        }
        if (groups.size() <= group) groups.resize(group + 1);
        groups[group].push_back(t);
    }
    return groups;
}

class OdeTrimesh final : public Detector {
public:
    explicit OdeTrimesh(const Settings& settings) : settings_(settings), found_(most_contacts) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        use_ode();
        topology_ = &topology;
        failure_.clear();
        bodies_.clear();
        if (is_answerable(topology, frame)) guard([&] { build(frame); });
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        use_ode();
        if (!is_answerable(*topology_, frame)) return;
        guard([&] {
            if (bodies_.empty()) {
                build(frame);  // the first frame could not be built from
            } else {
                follow(frame);
            }
        });
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        use_ode();
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        if (!check_no_query_distance(query_distance_, contacts)) return;
        if (failure_.empty()) guard([&] { query(contacts); });
        if (!failure_.empty()) {
            contacts.clear();
            contacts.outcome = {OutcomeKind::threw, failure_};
            failure_.clear();
        }
        contacts.sort();
    }

private:
    /// ODE's failed run-time checks arrive as exceptions, see ode_library.hpp.
    template <typename Work>
    void guard(const Work& work) {
        try {
            work();
        } catch (const std::exception& error) {
            failure_ = fmt::format("a check inside ODE failed: {}", error.what());
        }
    }

    void follow(const Frame& frame) {
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            MeshBody& body = bodies_[i];
            if (body.meshes.empty() || !baselines::may_have_moved(frame, topology_->bodies[i])) continue;
            fill_vertices(frame, topology_->bodies[i], body);
            for (const auto& mesh : body.meshes) {
                if (settings_.refit) {
                    dGeomTriMeshDataUpdate(mesh->data);
                } else {
                    build_tree(body, *mesh);
                    dGeomTriMeshSetData(mesh->geom, mesh->data);
                }
            }
        }
    }

    void query(ContactSet& contacts) {
        contacts.work.vertices_read = topology_->vertex_count;
        for (const auto& [a, b] : topology_->body_pairs) {
            for (const auto& first : bodies_[static_cast<std::size_t>(a)].meshes) {
                for (const auto& second : bodies_[static_cast<std::size_t>(b)].meshes) {
                    collide(*first, *second, contacts);
                }
            }
        }
    }

    void collide(const Mesh& first, const Mesh& second, ContactSet& contacts) {
        merge_log.first_geom = first.geom;
        merge_log.pairs.clear();
        const int count = dCollide(first.geom, second.geom, most_contacts, found_.data(), sizeof(dContactGeom));
        if (count >= most_contacts) contacts.truncated = true;
        const auto add_pair = [&](int i, int j) {
            if (i < 0 || j < 0 || i >= first.triangle_count() || j >= second.triangle_count()) return;
            contacts.pairs.push_back(
                {first.triangles[static_cast<std::size_t>(i)], second.triangles[static_cast<std::size_t>(j)]});
        };
        for (const auto& [i, j] : merge_log.pairs) add_pair(i, j);
        for (int k = 0; k < count; ++k) {
            const dContactGeom& found = found_[static_cast<std::size_t>(k)];
            add_pair(found.side1, found.side2);
            if (found.side1 >= first.triangle_count() || found.side2 >= second.triangle_count()) continue;
            if (!contacts.native_wanted) continue;
            Contact contact;
            if (found.side1 >= 0) contact.a = first.triangles[static_cast<std::size_t>(found.side1)];
            if (found.side2 >= 0) contact.b = second.triangles[static_cast<std::size_t>(found.side2)];
            contact.point = Vector3(found.pos[0], found.pos[1], found.pos[2]) / settings_.scale;
            contact.normal = -Vector3(found.normal[0], found.normal[1], found.normal[2]);
            contact.depth = found.depth / settings_.scale;
            contacts.native.push_back(contact);
        }
    }

    void fill_vertices(const Frame& frame, const BodyRange& range, MeshBody& body) const {
        const auto count = 3 * static_cast<std::size_t>(range.vertices.count);
        const double* const position = frame.position.data() + 3 * static_cast<std::size_t>(range.vertices.first);
        for (std::size_t i = 0; i < count; ++i) body.vertices[i] = position[i] * settings_.scale;
        if (!body.padded) return;
        // The far triangle: a copy, moved by eight times the size of the scene.
        const double size = (frame.position.rowwise().maxCoeff() - frame.position.rowwise().minCoeff()).maxCoeff();
        for (int k = 0; k < 3; ++k) {
            const auto to = count + 3 * static_cast<std::size_t>(k);
            const Index vertex = topology_->triangles(k, body.near_triangle);
            const auto from = 3 * static_cast<std::size_t>(vertex - range.vertices.first);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                body.vertices[to + axis] = body.vertices[from + axis] + 8.0 * size * settings_.scale;
            }
        }
    }

    static void build_tree(const MeshBody& body, const Mesh& mesh) {
        // Counts are in vertices and in indices, strides in bytes.
        dGeomTriMeshDataBuildDouble(mesh.data, body.vertices.data(), 3 * sizeof(double),
                                    static_cast<int>(body.vertices.size() / 3), mesh.indices.data(),
                                    static_cast<int>(mesh.indices.size()), 3 * sizeof(std::uint32_t));
    }

    void build(const Frame& frame) {
        bodies_.resize(topology_->bodies.size());
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            const BodyRange& range = topology_->bodies[i];
            if (range.triangles.count > 0) build_body(frame, range, bodies_[i]);
        }
    }

    void build_body(const Frame& frame, const BodyRange& range, MeshBody& body) const {
        std::vector<std::vector<Index>> groups;
        if (settings_.split) {
            groups = without_common_vertices(*topology_, range);
        } else {
            groups.emplace_back();
            for (Index t = range.triangles.first; t < range.triangles.end(); ++t) groups.back().push_back(t);
        }
        const auto vertex_count = static_cast<std::uint32_t>(range.vertices.count);
        for (std::vector<Index>& group : groups) {
            auto mesh = std::make_unique<Mesh>();
            mesh->triangles = std::move(group);
            for (const Index t : mesh->triangles) {
                for (int k = 0; k < 3; ++k) {
                    mesh->indices.push_back(
                        static_cast<std::uint32_t>(topology_->triangles(k, t) - range.vertices.first));
                }
            }
            if (mesh->triangle_count() == 1) {
                if (!body.padded) body.near_triangle = mesh->triangles.front();
                body.padded = true;
                for (std::uint32_t k = 0; k < 3; ++k) mesh->indices.push_back(vertex_count + k);
            }
            body.meshes.push_back(std::move(mesh));
        }
        body.vertices.resize(3 * (static_cast<std::size_t>(vertex_count) + (body.padded ? 3 : 0)));
        fill_vertices(frame, range, body);
        for (const auto& mesh : body.meshes) {
            mesh->data = dGeomTriMeshDataCreate();
            build_tree(body, *mesh);
            mesh->geom = dCreateTriMesh(nullptr, mesh->data, nullptr, nullptr, nullptr);
            dGeomTriMeshSetTriMergeCallback(mesh->geom, note_merge);
        }
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;   ///< m
    std::vector<MeshBody> bodies_;  ///< without meshes where a body has no triangles
    std::vector<dContactGeom> found_;
    std::string failure_;
};

}  // namespace

DetectorEntry ode_trimesh_detector() {
    use_ode();
    return {
        .name = "ode_trimesh",
        .library = "ODE",
        .version = TROCAR_ODE_VERSION,
        .configuration = fmt::format("sizeof(dReal) {}; {}", sizeof(dReal), ode_configuration()),
        .native_contacts = true,
        .parameters = {number_parameter("scale", "1", "1000", 1e-6, 1e9,
                                        "length units that ODE sees per metre; ODE merges contacts within 1e-4 units"),
                       choice_parameter("update", "refit", {"refit", "rebuild"},
                                        "follow the vertices in the same tree, or build a new tree every tick"),
                       choice_parameter("merge", "as_is", {"as_is", "none"},
                                        "one trimesh per body, or several whose triangles share no vertex, so that no "
                                        "pair is lost by merging contacts")},
        .make = [](const ParameterValues& values) -> std::unique_ptr<Detector> {
            if (!ode_precision_matches()) {
                throw InputError("ode_trimesh: ODE's library and headers differ in the size of a number");
            }
            return std::make_unique<OdeTrimesh>(Settings{.scale = values.number("scale"),
                                                         .refit = values.is("update", "refit"),
                                                         .split = values.is("merge", "none")});
        }};
}

}  // namespace trocar
