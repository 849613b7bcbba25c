#include "commands.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string_view>

#include "csv.hpp"
#include "errors.hpp"
#include "icp.hpp"
#include "json.hpp"
#include "odometry.hpp"
#include "settings.hpp"
#include "simulation.hpp"
#include "text.hpp"

namespace icp2d {
namespace {

using Path = std::filesystem::path;

constexpr const char* usage =
    "usage: icp2d match TARGET.csv SOURCE.csv PARAMETERS.json | align PAIRS.csv | "
    "integrate INCREMENTS.csv X Y THETA | demo SEED | batch COMMANDS.txt";

double number_argument(const std::string& word) {
    if (const auto value = to_number(word)) return *value;
    throw UsageError(shown(word) + " is not a finite number; " + usage);
}

std::mt19937::result_type seed_argument(const std::string& word) {
    const bool is_whole = word.find_first_not_of("0123456789") == std::string::npos;
    const auto value = to_number(word);
    if (!is_whole || !value || *value > std::numeric_limits<std::uint32_t>::max()) {
        throw UsageError(shown(word) + " is not a whole number from 0 to 2^32 - 1; " + usage);
    }
    return static_cast<std::mt19937::result_type>(*value);
}

std::string match(const Path& target_file, const Path& source_file, const Path& settings_file) {
    const Points target = read_points(target_file);
    const Points source = read_points(source_file);
    const Settings settings = read_settings(settings_file);
    const Result result = icp(source, target, to_transform(settings.initial), settings.icp);

    std::optional<Pose> pose;
    if (result.T_target_source) pose = to_pose(*result.T_target_source);
    const auto part = [&](double Pose::*member) {
        return pose ? std::optional(*pose.*member) : std::nullopt;
    };
    return JsonObject()
        .add("x", part(&Pose::x))
        .add("y", part(&Pose::y))
        .add("theta", part(&Pose::theta))
        .add("termination", to_string(result.termination))
        .add("iterations", result.iterations)
        .add("inlier_count", result.correspondences.inlier_count())
        .add("fitness", result.correspondences.fitness)
        .add("inlier_rmse", result.correspondences.inlier_rmse)
        .add("cost", result.correspondences.cost)
        .str();
}

std::string align(const Path& pairs_file) {
    const auto T_target_source = icp2d::align(read_pairs(pairs_file));
    if (!T_target_source) {
        return JsonObject()
            .add("error", "degenerate: the pairs leave the rotation undetermined")
            .str();
    }
    const Pose pose = to_pose(*T_target_source);
    return JsonObject().add("x", pose.x).add("y", pose.y).add("theta", pose.theta).str();
}

std::string integrate(const Path& increments_file, const Pose& start) {
    const auto poses = icp2d::integrate(start, read_increments(increments_file));
    return JsonObject().add("poses", poses).str();
}

std::string demo(std::mt19937::result_type seed) {
    constexpr double degree = pi / 180.0;
    constexpr Pose truth{0.35, 0.10, 6.0 * degree};
    constexpr Pose guess{0.20, 0.0, 3.0 * degree};

    std::mt19937 rng(seed);
    const Points world = simulate_world(rng);
    const Points target = simulate_scan(world, Eigen::Isometry2d::Identity(), rng);
    const Points source = simulate_scan(world, to_transform(truth), rng);

    Odometry odometry;
    step(odometry, target);
    const Result result = step(odometry, source, guess).value();

    return JsonObject()
        .add("truth", truth)
        .add("estimate", odometry.pose)
        .add("iterations", result.iterations)
        .add("termination", to_string(result.termination))
        .add("inlier_count", result.correspondences.inlier_count())
        .add("inlier_rmse", result.correspondences.inlier_rmse)
        .str();
}

}  // namespace

std::string answer(const std::vector<std::string>& words, const Path& folder) {
    const auto is = [&](std::string_view name, std::size_t arguments) {
        return words.size() == arguments + 1 && words.front() == name;
    };
    const auto file = [&](std::size_t argument) { return folder / words[argument]; };

    if (is("match", 3)) return match(file(1), file(2), file(3));
    if (is("align", 1)) return align(file(1));
    if (is("integrate", 4)) {
        const Pose start{number_argument(words[2]), number_argument(words[3]),
                         number_argument(words[4])};
        return integrate(file(1), start);
    }
    if (is("demo", 1)) return demo(seed_argument(words[1]));
    throw UsageError(usage);
}

}  // namespace icp2d
