// ODE 0.16, trimesh against trimesh (OPCODE trees): one trimesh per body, each listed body pair collided once a tick.
//
// Settings, and where they depart from the library's defaults (measured facts in README.md):
//  dCollide directly  no space: after dGeomTriMeshDataUpdate the box that a space culls by stays at the old place.
//  update             dGeomTriMeshDataUpdate, which refits the tree; vertices are referenced, not copied, so they are
//  kept
//                     here as doubles with a stride of 24 bytes. `rebuild` builds the data anew.
//  contacts           the cap is the low 16 bits of the flags: 65535, the largest, so that nothing is cut off.
//                     CONTACTS_UNIMPORTANT stays off.
//  temporal coherence off (default); it exists for sphere, box and capsule only.
//  messages           silenced, since they are printed in the middle of a query.
//  one triangle       a trimesh of a single triangle is missed or crashes: it gets a second one far away, whose hits
//                     are dropped.
// Inside, OPCODE narrows all coordinates to float32, in the double-precision build too.
//
// What its pairs mean: ODE has no list of intersecting triangles. Contacts of different pairs that lie within 1e-4 of a
// length unit are merged: averaged when their depths agree within 1e-5 units, else only the deeper one stays. The merge
// callbacks, installed on both meshes, still tell the triangles of an averaged contact, and they are counted as pairs;
// a pair all of whose contacts were dropped or replaced is lost. There is no other public way to OPCODE's own pair
// list. So recall depends on the unit of length; `scale` is the factor from metres to the unit that ODE sees. The
// default, millimetres, loses least without inventing pairs: on six generated scenes 0.85 to 1.00 of the true pairs, in
// metres 0.83 to 1.00, from 1e5 units a metre upwards and from 0.1 downwards with wrong pairs. Native contacts: points
// and depths against infinite planes; the normal points into the first geom in ODE and is turned here, so that it
// points from the first body to the second. Merged contacts have no triangle (-1).
#include <fmt/format.h>
#include <ode/ode.h>

#include <array>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <vector>

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

/// One body as ODE sees it.
struct Mesh {
    std::vector<double> vertices;  ///< 3 per vertex, in ODE's unit
    std::vector<std::uint32_t> indices;
    dTriMeshDataID data = nullptr;
    dGeomID geom = nullptr;
    int triangle_count = 0;  ///< without the far one

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

struct Settings {
    double scale = 1000.0;
    bool refit = true;
};

class OdeTrimesh final : public Detector {
public:
    explicit OdeTrimesh(const Settings& settings) : settings_(settings), found_(most_contacts) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        use_ode();
        topology_ = &topology;
        meshes_.clear();
        if (is_answerable(topology, frame)) build(frame);
    }

    void update(const Frame& frame) override {
        use_ode();
        if (!is_answerable(*topology_, frame)) return;
        if (meshes_.empty()) {
            build(frame);  // the first frame could not be built from
            return;
        }
        for (std::size_t body = 0; body < meshes_.size(); ++body) {
            Mesh* const mesh = meshes_[body].get();
            if (mesh == nullptr) continue;
            fill_vertices(frame, topology_->bodies[body], *mesh);
            if (settings_.refit) {
                dGeomTriMeshDataUpdate(mesh->data);
            } else {
                build_tree(*mesh);
                dGeomTriMeshSetData(mesh->geom, mesh->data);
            }
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        use_ode();
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        try {
            query(contacts);
        } catch (const std::exception& error) {
            contacts.clear();
            contacts.outcome = {OutcomeKind::threw, fmt::format("a check inside ODE failed: {}", error.what())};
        }
        contacts.sort_pairs();
    }

private:
    void query(ContactSet& contacts) {
        contacts.work.vertices_read = topology_->vertex_count;
        for (const auto& [a, b] : topology_->body_pairs) {
            const Mesh* const first = meshes_[static_cast<std::size_t>(a)].get();
            const Mesh* const second = meshes_[static_cast<std::size_t>(b)].get();
            if (first == nullptr || second == nullptr) continue;
            merge_log.first_geom = first->geom;
            merge_log.pairs.clear();
            const int count = dCollide(first->geom, second->geom, most_contacts, found_.data(), sizeof(dContactGeom));
            if (count >= most_contacts) contacts.truncated = true;
            const Index first_triangle = topology_->bodies[static_cast<std::size_t>(a)].triangles.first;
            const Index second_triangle = topology_->bodies[static_cast<std::size_t>(b)].triangles.first;
            const auto add_pair = [&](int i, int j) {
                if (i < 0 || j < 0 || i >= first->triangle_count || j >= second->triangle_count) return;
                contacts.pairs.push_back({first_triangle + i, second_triangle + j});
            };
            for (const auto& [i, j] : merge_log.pairs) add_pair(i, j);
            for (int k = 0; k < count; ++k) {
                const dContactGeom& found = found_[static_cast<std::size_t>(k)];
                add_pair(found.side1, found.side2);
                if (found.side1 >= first->triangle_count || found.side2 >= second->triangle_count) continue;
                if (!contacts.native_wanted) continue;
                Contact contact;
                if (found.side1 >= 0) contact.a = first_triangle + found.side1;
                if (found.side2 >= 0) contact.b = second_triangle + found.side2;
                contact.point = Vector3(found.pos[0], found.pos[1], found.pos[2]) / settings_.scale;
                contact.normal = -Vector3(found.normal[0], found.normal[1], found.normal[2]);
                contact.depth = found.depth / settings_.scale;
                contacts.native.push_back(contact);
            }
        }
    }

    void fill_vertices(const Frame& frame, const BodyRange& body, Mesh& mesh) const {
        const auto count = 3 * static_cast<std::size_t>(body.vertices.count);
        const double* const position = frame.position.data() + 3 * static_cast<std::size_t>(body.vertices.first);
        for (std::size_t i = 0; i < count; ++i) mesh.vertices[i] = position[i] * settings_.scale;
        if (mesh.triangle_count == 1) {
            // The far triangle: a copy, moved by eight times the size of the scene.
            const double size = (frame.position.rowwise().maxCoeff() - frame.position.rowwise().minCoeff()).maxCoeff();
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t from = 3 * static_cast<std::size_t>(mesh.indices[k]);
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    mesh.vertices[count + 3 * k + axis] = mesh.vertices[from + axis] + 8.0 * size * settings_.scale;
                }
            }
        }
    }

    static void build_tree(Mesh& mesh) {
        // Counts are in vertices and in indices, strides in bytes.
        dGeomTriMeshDataBuildDouble(mesh.data, mesh.vertices.data(), 3 * sizeof(double),
                                    static_cast<int>(mesh.vertices.size() / 3), mesh.indices.data(),
                                    static_cast<int>(mesh.indices.size()), 3 * sizeof(std::uint32_t));
    }

    void build(const Frame& frame) {
        for (const BodyRange& body : topology_->bodies) {
            meshes_.push_back(nullptr);
            if (body.triangles.count == 0) continue;
            auto mesh = std::make_unique<Mesh>();
            mesh->triangle_count = body.triangles.count;
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                for (int k = 0; k < 3; ++k) {
                    mesh->indices.push_back(
                        static_cast<std::uint32_t>(topology_->triangles(k, t) - body.vertices.first));
                }
            }
            auto vertex_count = static_cast<std::uint32_t>(body.vertices.count);
            if (mesh->triangle_count == 1) {
                for (std::uint32_t k = 0; k < 3; ++k) mesh->indices.push_back(vertex_count + k);
                vertex_count += 3;
            }
            mesh->vertices.resize(3 * static_cast<std::size_t>(vertex_count));
            fill_vertices(frame, body, *mesh);
            mesh->data = dGeomTriMeshDataCreate();
            build_tree(*mesh);
            mesh->geom = dCreateTriMesh(nullptr, mesh->data, nullptr, nullptr, nullptr);
            dGeomTriMeshSetTriMergeCallback(mesh->geom, note_merge);
            meshes_.back() = std::move(mesh);
        }
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    std::vector<std::unique_ptr<Mesh>> meshes_;  ///< one per body, null for a body without triangles
    std::vector<dContactGeom> found_;
};

}  // namespace

DetectorEntry ode_trimesh_detector() {
    use_ode();
    return {.name = "ode_trimesh",
            .library = "ODE",
            .version = TROCAR_ODE_VERSION,
            .configuration = fmt::format("sizeof(dReal) {}; {}", sizeof(dReal), ode_configuration()),
            .information = InformationLevel::contacts,
            .native_contacts = true,
            .parameters = {{.name = "scale",
                            .unit = "1",
                            .default_value = "1000",
                            .minimum = 1e-6,
                            .maximum = 1e9,
                            .meaning = "length units that ODE sees per metre; ODE merges contacts within 1e-4 units"},
                           {.name = "update",
                            .type = Parameter::Type::choice,
                            .default_value = "refit",
                            .choices = {"refit", "rebuild"},
                            .meaning = "follow the vertices in the same tree, or build a new tree every tick"}},
            .make = [](const ParameterValues& values) -> std::unique_ptr<Detector> {
                if (!ode_precision_matches()) {
                    throw InputError("ode_trimesh: ODE's library and headers differ in the size of a number");
                }
                return std::make_unique<OdeTrimesh>(
                    Settings{.scale = values.number("scale"), .refit = values.is("update", "refit")});
            }};
}

}  // namespace trocar
