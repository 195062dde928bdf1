// ParaView's files of a run: per tick the bodies and what acted on them, and one collection with their times.
#pragma once

#include <variant>

#include "export/exporter.hpp"

namespace trocar {

/// NAME.pvd, and per tick NAME_bodies_TICK.vtp and NAME_contacts_TICK.vtp. Doubles in SI units, world frame.
/// - Bodies: all triangles with `body`; at vertices `depth` (m), `strain` (1), `displacement` (m) and `body` as in
///   PlayedFrame. Field data: body names, and for every instrument its body, force (N) and moment about its tip (N m).
/// - Contacts: one vertex each with `normal`, `force` (N on `body`), `depth` (m), `kind`, `body` and `other` (-1:
///   unknown). Unknown values are 0; `force_reported` marks known forces. Field data: names of kinds and bodies.
std::unique_ptr<Exporter> paraview_exporter(const Topology& topology, const std::string& name,
                                            const std::filesystem::path& folder);

/// One array of a VTK file: Float64, Int32 or String.
struct VtkArray {
    std::string name;
    int components = 1;
    std::variant<std::vector<double>, std::vector<std::int32_t>, std::vector<std::string>> values;
};

/// Poly data as VTK has it: points, and either triangles or one vertex cell per point.
struct VtkPolyData {
    Matrix3X points = Matrix3X(3, 0);
    Triangles triangles = Triangles(3, 0);
    bool points_are_cells = false;
    std::vector<VtkArray> at_points;
    std::vector<VtkArray> at_cells;
    std::vector<VtkArray> field;
};

/// The text of a .vtp file (VTK XML, version 1.0, base64 with a 64-bit head, little-endian).
std::string to_vtp(const VtkPolyData& data);

}  // namespace trocar
