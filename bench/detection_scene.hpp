// The scene of the detection benches: a closed slab of tissue whose every vertex moves every tick, and an instrument of
// a shaft and two jaws that dips into it. Tick by tick the same for every detector.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "support/shapes.hpp"

namespace trocar::bench {

/// Shaft and two jaws as one body of about `triangles` triangles, tips at the origin, pointing down.
inline test::Shape instrument(int triangles) {
    const auto cylinder = [](double radius, double length, int count) {
        // Nearly square quads: around × along × 2 triangles.
        const double ratio = length / (2.0 * 3.14159265 * radius);
        const int around = std::max(6, static_cast<int>(std::lround(std::sqrt(count / 2.0 / ratio))));
        return test::shaft(radius, length, around, std::max(1, static_cast<int>(std::lround(count / 2.0 / around))));
    };
    test::Shape whole;
    const auto append = [&whole](const test::Shape& part) {
        const auto shift = static_cast<Index>(whole.vertices.size());
        whole.vertices.insert(whole.vertices.end(), part.vertices.begin(), part.vertices.end());
        for (const auto& t : part.triangles) whole.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    };
    append(cylinder(0.002, 0.02, triangles / 5).rotate({0, 1, 0}, 0.2).move({0.0005, 0.0, 0.0}));
    append(cylinder(0.002, 0.02, triangles / 5).rotate({0, 1, 0}, -0.2).move({-0.0005, 0.0, 0.0}));
    append(cylinder(0.005, 0.15, triangles * 3 / 5).move({0.0, 0.0, 0.019}));
    return whole;
}

struct DetectionScene {
    test::World world;
    std::vector<Frame> frames;
};

/// tissue_triangles, instrument_triangles: about so many. depth: of the tips below the surface, m.
inline DetectionScene detection_scene(int tissue_triangles, int instrument_triangles, double depth, int ticks,
                                      double tilt = 0.3) {
    const int n = std::max(2, static_cast<int>(std::lround(std::sqrt(tissue_triangles / 4.0) - 1.0)));
    DetectionScene scene;
    scene.world =
        test::make_world("slab and instrument",
                         {{BodyKind::instrument,
                           instrument(instrument_triangles).rotate({0.4, 1.0, 0.0}, tilt).move({0.0, 0.0, -depth}),
                           {}},
                          {BodyKind::tissue, test::slab(0.2, 0.02, n), {}}});
    const Matrix3X rest = scene.world.frame.position;
    for (int tick = 0; tick < ticks; ++tick) {
        Matrix3X position = rest;
        const double phase = 0.3 * tick;
        for (Index v = 0; v < scene.world.topology.vertex_count; ++v) {
            const Vector3 x = rest.col(v);
            if (scene.world.topology.bodies[0].vertices.contains(v)) {
                position.col(v) += 0.001 * Vector3(std::sin(phase), std::cos(phase), 0.3 * std::sin(2.0 * phase));
            } else {
                position.col(v) += 0.0004 * Vector3(std::sin(41.0 * x[1] + phase), std::cos(37.0 * x[0] - phase),
                                                    std::sin(60.0 * x[0] + 47.0 * x[1] + phase));
            }
        }
        scene.frames.push_back(test::frame_of(std::move(position)));
        scene.frames.back().tick = tick;
    }
    return scene;
}

}  // namespace trocar::bench
