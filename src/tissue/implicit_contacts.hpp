// Contacts and friction of an implicit step as constraints with the full compliance A⁻¹ of the tissue. The free motion
// comes first, then the correction, as in SOFA's constraint solvers.
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

    /// Computes `force` and `rubbed` of all contacts over a step of h (s), such that every contact law holds at its
    /// end. `state` has the velocities of the free motion. `known`: the normal forces are prescribed (settings
    /// `unilateral` and `explicit`), and only friction is computed.
    void solve(double h, bool known, const SpringArrays& springs, const SpringSystem& system,
               const VolumeSystem& volumes, const TissueState& state, double tolerance, int iterations,
               TickContacts& contacts);
    /// Adds the impulses (N s) of all forces of `solve` to a right side, 4 × vertices of the state.
    static void add_impulses(double h, const TickContacts& contacts, Matrix4X& right_side);

private:
    /// One direction in which a contact acts.
    struct Row {
        std::size_t contact = 0;
        Vector3 direction = Vector3::Zero();
        double rate = 0.0;  ///< m/s, of the free motion
    };
    /// Arguments of one `solve`, for find_columns.
    struct Question {
        const VolumeSystem* volumes = nullptr;
        const TickContacts* contacts = nullptr;
        double tolerance = 0.0;
        int iterations = 0;
    };
    void list_rows(const TissueState& state, TickContacts& contacts);
    /// Computes missing columns of `answer_` for the wanted rows in [first, last).
    template <typename Wanted>
    void answer_to(std::size_t first, std::size_t last, const Wanted& wanted);
    void find_columns();
    /// m/s, of a row under the current forces.
    [[nodiscard]] double rate(std::size_t row, double h) const;
    bool solve_pressing(double h, std::span<TickContact> contacts);
    void guess_pressing(double h, std::span<TickContact> contacts);
    void find_pressing(double h, std::span<TickContact> contacts);
    double rub(double h, bool keep, TickContacts& contacts);

    Compliance compliance_;
    std::vector<double> swell_;  ///< m²/kg, per row: flow into an enclosure (m³/s) per impulse (N s)
    std::vector<Row> rows_;      ///< normals first, one per contact; then two tangents per contact with friction
    std::vector<std::size_t> rub_rows_;  ///< per contact: its first tangential row; 0: no friction
    std::vector<double> force_;          ///< N, per row
    /// m/s per N s, rows × rows: rate of each row per impulse on the row of the column. Only rows that have exerted a
    /// force have a column, because most contacts of a step only come near.
    Eigen::MatrixXd answer_;
    std::vector<std::uint8_t> has_column_;  ///< per row
    std::vector<std::size_t> columns_;      ///< rows with a column, in the order of computation
    std::vector<std::size_t> missing_;      ///< rows without a column that need one
    std::vector<double> gap_;               ///< m, per contact, after the step under the guessed forces
    Question question_;
    Eigen::MatrixXd matrix_;  ///< of the contacts in `on_`
    Eigen::VectorXd right_side_;
    std::vector<std::size_t> on_;  ///< active contacts with an unknown force
};

}  // namespace trocar
