// MRPT's ICP of two planar point maps behind one C function, for mrpt.py.

#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/slam/CICP.h>

using mrpt::maps::CSimplePointsMap;
using mrpt::poses::CPose2D;

static CSimplePointsMap to_map(const double* xy, int count) {
    CSimplePointsMap map;
    map.reserve(count);
    for (int i = 0; i < count; ++i) map.insertPointFast(xy[2 * i], xy[2 * i + 1], 0.0F);
    return map;
}

// pose: the guess (x, y, theta) of the source in the target; replaced by the estimate.
// Returns the number of iterations.
extern "C" int match(const double* source, int source_count, const double* target,
                     int target_count, double gate, double finest_gate, int max_iterations,
                     double tolerance, double* pose) {
    mrpt::slam::CICP icp;
    icp.options.ICP_algorithm = mrpt::slam::icpClassic;
    icp.options.ICP_covariance_method = mrpt::slam::icpCovLinealMSE;  // the cheap one
    icp.options.skip_cov_calculation = true;
    icp.options.corresponding_points_decimation = 1;
    icp.options.thresholdDist = gate;
    icp.options.smallestThresholdDist = finest_gate;
    icp.options.maxIterations = max_iterations;
    icp.options.minAbsStep_trans = icp.options.minAbsStep_rot = tolerance;

    const CSimplePointsMap older = to_map(target, target_count);
    const CSimplePointsMap newer = to_map(source, source_count);
    mrpt::slam::CICP::TReturnInfo info;
    const auto pdf = icp.Align(&older, &newer, CPose2D(pose[0], pose[1], pose[2]), info);
    const CPose2D estimate = pdf->getMeanVal();
    pose[0] = estimate.x();
    pose[1] = estimate.y();
    pose[2] = estimate.phi();
    return static_cast<int>(info.nIterations);
}
