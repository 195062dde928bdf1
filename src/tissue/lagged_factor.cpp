#include "tissue/lagged_factor.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace trocar {

/// Factorisation in the second thread. A is stored in an elimination order of vertices, so that L consists of whole 3×3
/// blocks. Only its upper triangle is stored, because Eigen takes that without a copy.
class LaggedFactor::Factorization {
public:
    Factorization(const SpringArrays& springs, const TissueState& state);
    [[nodiscard]] const std::vector<Index>& vertex() const { return vertex_; }
    /// Factors a system. Writes the pattern only the first time, because later calls run while it is read. Returns
    /// false if the system is not finite or not positive definite.
    bool make(const SpringSystem& system, FactorPattern& pattern, FactorValues& values);

private:
    /// Position of a block of A: index among the blocks above the diagonal, and place of its columns.
    struct Spot {
        std::size_t block = none;  ///< none: an end is fixed
        std::size_t column = 0;
        static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    };
    using Matrix = Eigen::SparseMatrix<double>;
    using Entry = Eigen::Triplet<double>;

    void order(const std::vector<Entry>& couplings, std::size_t vertex_count);
    void lay_out();
    [[nodiscard]] Spot spot(Index v, Index w) const;
    [[nodiscard]] double* begin_of(std::size_t place, std::size_t axis);
    void add(std::size_t place, const Matrix3& block);
    void add(const Spot& above, const Matrix3& block);
    void fill(const SpringSystem& system, std::vector<std::uint8_t>& was_still);
    void take_pattern(FactorPattern& pattern) const;
    bool take_values(const FactorPattern& pattern, FactorValues& values) const;

    std::vector<Index> vertex_;               ///< per place
    std::vector<Index> place_;                ///< per vertex of the state; -1: fixed
    std::vector<std::size_t> first_;          ///< per place + 1: first block of A above the diagonal in its columns
    std::vector<Index> row_;                  ///< per block: place of its rows, ascending in a column
    std::vector<std::array<Index, 2>> ends_;  ///< per spring: vertices
    std::vector<Spot> spring_spot_;           ///< per spring
    Matrix matrix_;
    Eigen::SimplicialLDLT<Matrix, Eigen::Upper, Eigen::NaturalOrdering<int>> solver_;
    bool is_analysed_ = false;
};

LaggedFactor::Factorization::Factorization(const SpringArrays& springs, const TissueState& state) {
    std::vector<Entry> couplings;
    const auto couple = [&](Index v, Index w) {
        if (state.moves(v) && state.moves(w)) couplings.emplace_back(std::min(v, w), std::max(v, w), 1.0);
    };
    for (Index v = 0; v < static_cast<Index>(state.size()); ++v) couple(v, v);
    for (std::size_t s = 0; s < springs.size(); ++s) {
        ends_.push_back({springs.i[s], springs.j[s]});
        couple(springs.i[s], springs.j[s]);
    }
    order(couplings, state.size());
    lay_out();
    for (const auto& [i, j] : ends_) spring_spot_.push_back(spot(i, j));
}

/// Computes the elimination order by approximate minimum degree, and the block sparsity of A in it.
void LaggedFactor::Factorization::order(const std::vector<Entry>& couplings, std::size_t vertex_count) {
    place_.assign(vertex_count, -1);
    for (const Entry& entry : couplings) {
        if (entry.row() != entry.col()) continue;
        place_[at(entry.row())] = static_cast<Index>(vertex_.size());
        vertex_.push_back(entry.row());
    }
    first_.assign(vertex_.size() + 1, 0);
    if (vertex_.empty()) return;
    const auto graph_of = [&] {
        std::vector<Entry> entries;
        for (const Entry& entry : couplings) {
            const auto [row, column] = std::minmax(place_[at(entry.row())], place_[at(entry.col())]);
            entries.emplace_back(row, column, 1.0);
        }
        const auto size = static_cast<Eigen::Index>(vertex_.size());
        Matrix graph(size, size);
        graph.setFromTriplets(entries.begin(), entries.end());
        return graph;
    };
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> eliminated;
    Eigen::AMDOrdering<int>()(graph_of().selfadjointView<Eigen::Upper>(), eliminated);
    const std::vector<Index> before = vertex_;
    for (std::size_t place = 0; place < vertex_.size(); ++place) {
        vertex_[place] = before[at(eliminated.indices()[static_cast<Eigen::Index>(place)])];
        place_[at(vertex_[place])] = static_cast<Index>(place);
    }
    const Matrix graph = graph_of();
    for (std::size_t place = 0; place < vertex_.size(); ++place) {
        for (Matrix::InnerIterator entry(graph, static_cast<Eigen::Index>(place)); entry; ++entry) {
            if (entry.row() != entry.col()) row_.push_back(static_cast<Index>(entry.row()));
        }
        first_[place + 1] = row_.size();
    }
}

/// Lays out the sparse matrix by columns: three entries of each block, then the upper triangle of the own block.
void LaggedFactor::Factorization::lay_out() {
    const auto size = static_cast<Eigen::Index>(3 * vertex_.size());
    matrix_.resize(size, size);
    matrix_.resizeNonZeros(static_cast<Eigen::Index>(9 * row_.size() + 6 * vertex_.size()));
    int* column = matrix_.outerIndexPtr();
    int* row = matrix_.innerIndexPtr();
    int entries = 0;
    for (std::size_t place = 0; place < vertex_.size(); ++place) {
        const auto own = static_cast<int>(3 * place);
        for (int axis = 0; axis < 3; ++axis) {
            *column++ = entries;
            for (std::size_t b = first_[place]; b < first_[place + 1]; ++b) {
                for (int other = 0; other < 3; ++other) row[entries++] = 3 * row_[b] + other;
            }
            for (int other = 0; other <= axis; ++other) row[entries++] = own + other;
        }
    }
    *column = entries;
}

LaggedFactor::Factorization::Spot LaggedFactor::Factorization::spot(Index v, Index w) const {
    if (place_[at(v)] < 0 || place_[at(w)] < 0) return {};
    const auto [row, column] = std::minmax(place_[at(v)], place_[at(w)]);
    const auto begin = row_.begin() + static_cast<std::ptrdiff_t>(first_[at(column)]);
    const auto end = row_.begin() + static_cast<std::ptrdiff_t>(first_[at(column) + 1]);
    return {static_cast<std::size_t>(std::lower_bound(begin, end, row) - row_.begin()), at(column)};
}

/// First number of a column of A.
double* LaggedFactor::Factorization::begin_of(std::size_t place, std::size_t axis) {
    return matrix_.valuePtr() + matrix_.outerIndexPtr()[3 * place + axis];
}

/// Adds to the diagonal block of a vertex.
void LaggedFactor::Factorization::add(std::size_t place, const Matrix3& block) {
    const std::size_t before = 3 * (first_[place + 1] - first_[place]);
    for (std::size_t c = 0; c < 3; ++c) {
        double* const numbers = begin_of(place, c) + before;
        for (std::size_t r = 0; r <= c; ++r) {
            numbers[r] += block(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
        }
    }
}

/// Adds to a block above the diagonal.
void LaggedFactor::Factorization::add(const Spot& above, const Matrix3& block) {
    const std::size_t before = 3 * (above.block - first_[above.column]);
    for (std::size_t c = 0; c < 3; ++c) {
        double* const numbers = begin_of(above.column, c) + before;
        for (std::size_t r = 0; r < 3; ++r) {
            numbers[r] += block(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
        }
    }
}

void LaggedFactor::Factorization::fill(const SpringSystem& system, std::vector<std::uint8_t>& was_still) {
    std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
    was_still.assign(vertex_.size(), 0);
    for (std::size_t place = 0; place < vertex_.size(); ++place) {
        const double inertia = system.inertia[at(vertex_[place])];
        was_still[place] = inertia == 0.0 ? 1 : 0;
        add(place, (inertia == 0.0 ? 1.0 : inertia) * Matrix3::Identity());
    }
    const auto moves = [&](Index v) { return system.inertia[at(v)] != 0.0; };
    for (std::size_t s = 0; s < ends_.size(); ++s) {
        const Vector3 direction(system.x[s], system.y[s], system.z[s]);
        const Matrix3 block =
            system.alpha[s] * direction * direction.transpose() + system.beta[s] * Matrix3::Identity();
        for (const Index v : ends_[s]) {
            if (moves(v)) add(at(place_[at(v)]), block);
        }
        if (moves(ends_[s][0]) && moves(ends_[s][1])) add(spring_spot_[s], -block);
    }
}

bool LaggedFactor::Factorization::make(const SpringSystem& system, FactorPattern& pattern, FactorValues& values) {
    if (vertex_.empty()) return false;
    fill(system, values.was_still);
    if (!is_analysed_) solver_.analyzePattern(matrix_);
    is_analysed_ = true;
    solver_.factorize(matrix_);
    if (solver_.info() != Eigen::Success) return false;
    if (pattern.vertex.empty()) take_pattern(pattern);
    return take_values(pattern, values);
}

void LaggedFactor::Factorization::take_pattern(FactorPattern& pattern) const {
    const Matrix& lower = solver_.matrixL().nestedExpression();
    pattern.vertex = vertex_;
    pattern.first_block.assign(1, 0);
    pattern.row.clear();
    for (std::size_t place = 0; place < vertex_.size(); ++place) {
        // The last column of a vertex has no subdiagonal entries of its own block.
        const auto* const column = lower.outerIndexPtr() + 3 * place + 2;
        for (auto entry = column[0]; entry < column[1]; entry += 3) {
            pattern.row.push_back(lower.innerIndexPtr()[entry] / 3);
        }
        pattern.first_block.push_back(pattern.row.size());
    }
}

/// Returns false if a number is not finite or a pivot is not positive.
bool LaggedFactor::Factorization::take_values(const FactorPattern& pattern, FactorValues& values) const {
    const Matrix& lower = solver_.matrixL().nestedExpression();
    const auto pivots = solver_.vectorD();
    values.block.resize(9 * pattern.row.size());
    values.corner.resize(3 * vertex_.size());
    values.inverse_pivot.resize(3 * vertex_.size());
    bool good = true;
    const auto checked = [&good](double number) {
        good = good && std::isfinite(number);
        return number;
    };
    for (std::size_t place = 0; place < vertex_.size(); ++place) {
        const auto entry = [&](std::size_t axis, std::size_t number) {
            return checked(lower.valuePtr()[at(lower.outerIndexPtr()[3 * place + axis]) + number]);
        };
        double* const corner = values.corner.data() + 3 * place;
        corner[0] = entry(0, 0);
        corner[1] = entry(0, 1);
        corner[2] = entry(1, 0);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double pivot = pivots[static_cast<Eigen::Index>(3 * place + axis)];
            good = good && pivot > 0.0;
            values.inverse_pivot[3 * place + axis] = checked(1.0 / pivot);
        }
        const std::size_t first = pattern.first_block[place];
        for (std::size_t b = first; b < pattern.first_block[place + 1]; ++b) {
            for (std::size_t c = 0; c < 3; ++c) {
                for (std::size_t r = 0; r < 3; ++r) {
                    values.block[9 * b + 3 * c + r] = entry(c, 2 - c + 3 * (b - first) + r);
                }
            }
        }
    }
    return good;
}

LaggedFactor::LaggedFactor(const SpringArrays& springs, const SpringSystem& system, const TissueState& state)
    : snapshot_(system), factorization_(std::make_unique<Factorization>(springs, state)) {
    numbers_.assign(3 * factorization_->vertex().size(), 0.0);
}

LaggedFactor::~LaggedFactor() = default;

void LaggedFactor::renew(const SpringSystem& system) {
    thread_.join();
    if (is_made_) {
        std::swap(used_, made_);
        is_ready_ = true;
    }
    // The sizes are equal, so that nothing is allocated.
    snapshot_.x = system.x;
    snapshot_.y = system.y;
    snapshot_.z = system.z;
    snapshot_.alpha = system.alpha;
    snapshot_.beta = system.beta;
    snapshot_.inertia = system.inertia;
    thread_.start(work_);
}

/// Throws nothing. On an exception, such as lack of memory, the current factor stays in use.
void LaggedFactor::make() {
    try {
        is_made_ = factorization_->make(snapshot_, pattern_, made_);
    } catch (...) {
        is_made_ = false;
    }
}

double LaggedFactor::precondition(const SpringSystem& system, const Matrix4X& residual, Matrix4X& preconditioned) {
    const auto places = pattern_.vertex.size();
    const auto is_solved = [&](std::size_t place) {
        return used_.was_still[place] == 0 && system.inertia[at(pattern_.vertex[place])] != 0.0;
    };
    for (std::size_t place = 0; place < places; ++place) {
        const double* const from = residual.col(pattern_.vertex[place]).data();
        const bool taken = is_solved(place);
        for (std::size_t axis = 0; axis < 3; ++axis) numbers_[3 * place + axis] = taken ? from[axis] : 0.0;
    }
    solve_in_place(numbers_.data());
    double sum = 0.0;
    for (std::size_t place = 0; place < places; ++place) {
        const double* const from = residual.col(pattern_.vertex[place]).data();
        double* const to = preconditioned.col(pattern_.vertex[place]).data();
        if (is_solved(place)) std::copy_n(numbers_.data() + 3 * place, 3, to);
        sum += from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
    }
    return sum;
}

/// Solves in place, 3 numbers per place: forward through L, then through D and backward through Lᵀ.
void LaggedFactor::solve_in_place(double* numbers) const {
    const double* const blocks = used_.block.data();
    const Index* const rows = pattern_.row.data();
    const std::size_t places = pattern_.vertex.size();
    for (std::size_t place = 0; place < places; ++place) {
        const double* const corner = used_.corner.data() + 3 * place;
        double* const own = numbers + 3 * place;
        const double x = own[0];
        const double y = own[1] - corner[0] * x;
        const double z = own[2] - corner[1] * x - corner[2] * y;
        own[1] = y;
        own[2] = z;
        for (std::size_t b = pattern_.first_block[place]; b < pattern_.first_block[place + 1]; ++b) {
            const double* const block = blocks + 9 * b;
            double* const other = numbers + 3 * rows[b];
            for (int r = 0; r < 3; ++r) other[r] -= (block[r] * x + block[3 + r] * y) + block[6 + r] * z;
        }
    }
    for (std::size_t place = places; place-- > 0;) {
        const double* const corner = used_.corner.data() + 3 * place;
        const double* const pivot = used_.inverse_pivot.data() + 3 * place;
        double* const own = numbers + 3 * place;
        double x = own[0] * pivot[0];
        double y = own[1] * pivot[1];
        double z = own[2] * pivot[2];
        for (std::size_t b = pattern_.first_block[place]; b < pattern_.first_block[place + 1]; ++b) {
            const double* const block = blocks + 9 * b;
            const double* const other = numbers + 3 * rows[b];
            x -= (block[0] * other[0] + block[1] * other[1]) + block[2] * other[2];
            y -= (block[3] * other[0] + block[4] * other[1]) + block[5] * other[2];
            z -= (block[6] * other[0] + block[7] * other[1]) + block[8] * other[2];
        }
        y -= corner[2] * z;
        x -= corner[0] * y + corner[1] * z;
        own[0] = x;
        own[1] = y;
        own[2] = z;
    }
}

}  // namespace trocar
