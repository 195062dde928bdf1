#include "scene/mesh_pair.hpp"

namespace trocar {

MeshPair make_mesh_pair(const Mesh& a, const Mesh& b) {
    const auto body = [](const char* name, const Mesh& mesh) {
        return Body{.name = name,
                    .kind = BodyKind::rigid,
                    .vertex_count = static_cast<Index>(mesh.vertices.cols()),
                    .triangles = mesh.triangles};
    };
    MeshPair pair;
    pair.topology = make_topology({body("a", a), body("b", b)}, {{0, 1}});
    pair.frame.position.resize(3, a.vertices.cols() + b.vertices.cols());
    pair.frame.position << a.vertices, b.vertices;
    pair.frame.previous = pair.frame.position;
    pair.frame.velocity.setZero(3, pair.frame.position.cols());
    return pair;
}

}  // namespace trocar
