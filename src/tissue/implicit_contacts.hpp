// Contacts and friction of an implicit step as constraints with the whole compliance of the tissue: a push at one
// contact moves all others through A⁻¹ (free motion first, then the correction, as SOFA's constraint solvers have it).
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <span>
#include <vector>

#include "tissue/compliance.hpp"
#include "tissue/tick_contacts.hpp"
#include "tissue/volume_system.hpp"

namespace trocar {

class ImplicitContacts {
public:
    ImplicitContacts(std::size_t spring_count, std::size_t vertex_count);

    /// Finds `force` and `rubbed` of all contacts over a step of h (s) such that every contact law holds at its end.
    /// `state` has the velocities of the free motion. `known`: the normal forces are what the contacts hold
    /// (settings `unilateral` and `explicit`), friction is found.
    void solve(double h, bool known, const SpringArrays& springs, const SpringSystem& system,
               const VolumeSystem& volumes, const TissueState& state, double tolerance, int iterations,
               TickContacts& contacts);
    /// Adds what all forces of `solve` give over the step, N s, to a right side of 4 × vertices of the state.
    static void add_impulses(double h, const TickContacts& contacts, Matrix4X& right_side);

private:
    /// One direction in which a contact can push.
    struct Row {
        std::size_t contact = 0;
        Vector3 direction = Vector3::Zero();
        double rate = 0.0;  ///< m/s, of the free motion
    };
    /// Of one `solve`, what finding columns asks for.
    struct Question {
        const VolumeSystem* volumes = nullptr;
        const TickContacts* contacts = nullptr;
        double tolerance = 0.0;
        int iterations = 0;
    };
    void list_rows(const TissueState& state, TickContacts& contacts);
    /// Sees to it that the answers to these rows are there.
    template <typename Wanted>
    void answer_to(std::size_t first, std::size_t last, const Wanted& wanted);
    void find_columns();
    /// m/s, with all forces as they are.
    [[nodiscard]] double rate(std::size_t row, double h) const;
    bool solve_pressing(double h, std::span<TickContact> contacts);
    void guess_pressing(double h, std::span<TickContact> contacts);
    void find_pressing(double h, std::span<TickContact> contacts);
    double rub(double h, bool keep, TickContacts& contacts);

    Compliance compliance_;
    std::vector<double> swell_;          ///< m³/(N s) per row and enclosure: what a push on it does to the volume
    std::vector<Row> rows_;              ///< normals first, one per contact; then two per contact that rubs
    std::vector<std::size_t> rub_rows_;  ///< per contact: its first row along the surface, 0 = does not rub
    std::vector<double> force_;          ///< N, per row
    /// rows × rows, m/s per N s: what each row feels of the one in whose column it is. Only rows that have given a
    /// force have a column: most contacts of a step only come near.
    Eigen::MatrixXd answer_;
    std::vector<std::uint8_t> has_column_;  ///< per row
    std::vector<std::size_t> columns_;      ///< rows that have one, in the order in which they were found
    std::vector<std::size_t> missing_;      ///< rows that need one
    std::vector<double> gap_;               ///< m, per contact, after the step with the forces of the guess
    Question question_;
    Eigen::MatrixXd matrix_;  ///< of the contacts that are on
    Eigen::VectorXd right_side_;
    std::vector<std::size_t> on_;  ///< contacts in matrix_
};

}  // namespace trocar
