#include "csv.hpp"

#include <string>

#include "errors.hpp"
#include "json.hpp"
#include "text.hpp"

namespace icp2d {
namespace {

using Row = std::vector<double>;

std::string trimmed(const std::string& field) {
    const auto first = field.find_first_not_of(" \t");
    if (first == std::string::npos) return {};
    return field.substr(first, field.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> fields;
    std::size_t begin = 0;
    while (true) {
        const auto comma = line.find(',', begin);
        fields.push_back(trimmed(line.substr(begin, comma - begin)));
        if (comma == std::string::npos) return fields;
        begin = comma + 1;
    }
}

/// The rows of a file, as many as it has lines: row i is line i + 1.
std::vector<Row> read_rows(const std::filesystem::path& file, std::size_t fewest_fields,
                           std::size_t most_fields, const std::string& expected) {
    std::vector<Row> rows;
    for (const std::string& line : read_lines(file)) {
        const auto number = rows.size() + 1;
        const auto fields = split(line);
        if (fields.size() < fewest_fields || fields.size() > most_fields) {
            throw InputError(file, number, "expected " + expected + ", got " + shown(line));
        }
        Row& row = rows.emplace_back();
        for (const std::string& field : fields) {
            const auto value = to_number(field);
            if (!value) throw InputError(file, number, shown(field) + " is not a finite number");
            row.push_back(*value);
        }
    }
    return rows;
}

}  // namespace

Points read_points(const std::filesystem::path& file) {
    const auto rows = read_rows(file, 2, 2, "x,y");
    if (rows.empty()) throw InputError(file, "holds no point, expected rows x,y");
    Points points(2, rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        points.col(static_cast<Eigen::Index>(i)) << rows[i][0], rows[i][1];
    }
    return points;
}

Pairs read_pairs(const std::filesystem::path& file) {
    const auto rows = read_rows(file, 4, 5, "px,py,qx,qy or px,py,qx,qy,w");
    if (rows.empty()) throw InputError(file, "holds no pair, expected rows px,py,qx,qy");
    const auto count = static_cast<Eigen::Index>(rows.size());
    Pairs pairs{Points(2, count), Points(2, count), Eigen::VectorXd::Ones(count)};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Row& row = rows[i];
        const auto column = static_cast<Eigen::Index>(i);
        pairs.p.col(column) << row[0], row[1];
        pairs.q.col(column) << row[2], row[3];
        if (row.size() == 5) pairs.w(column) = row[4];
        if (pairs.w(column) < 0.0) {
            throw InputError(file, i + 1,
                             "a weight must be at least 0, got " + to_json(pairs.w(column)));
        }
    }
    return pairs;
}

std::vector<Pose> read_increments(const std::filesystem::path& file) {
    std::vector<Pose> increments;
    for (const Row& row : read_rows(file, 3, 3, "dx,dy,dtheta")) {
        increments.push_back({row[0], row[1], row[2]});
    }
    return increments;
}

}  // namespace icp2d
