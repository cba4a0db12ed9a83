// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Registers pairs of point clouds with PCL, from the identity.
//
//   pcl_register gicp VOXEL MAX_DISTANCE ITERATIONS EPSILON
//   pcl_register ndt VOXEL RESOLUTION STEP_SIZE ITERATIONS EPSILON
//
// VOXEL [m] is the side of the voxels that are reduced to one point; 0 keeps all points. A step
// below EPSILON is the last; 0 does all ITERATIONS.
//
// Standard input has, for each pair, two uint32 (points of the source, of the target) and the
// points as float32 x y z [m]. For each pair standard output gets 16 float64, T_target_source row
// by row; all are NaN where there is none. All numbers are of this machine's byte order.

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <pcl/console/print.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/ndt.h>

using Point = pcl::PointXYZ;
using Cloud = pcl::PointCloud<Point>;
using Registration = pcl::Registration<Point, Point>;

constexpr std::size_t kFewestPoints = 100;

struct Settings {
  float voxel = 0.0F;
  std::unique_ptr<Registration> registration;
};

Settings parse(const std::vector<std::string>& words) {
  const auto number = [&words](std::size_t i) { return std::stod(words.at(i)); };
  Settings settings;
  settings.voxel = static_cast<float>(number(1));
  std::size_t next = 0;
  if (words.at(0) == "gicp") {
    auto gicp = std::make_unique<pcl::GeneralizedIterativeClosestPoint<Point, Point>>();
    gicp->setMaxCorrespondenceDistance(number(2));
    next = 3;
    settings.registration = std::move(gicp);
  } else if (words.at(0) == "ndt") {
    auto ndt = std::make_unique<pcl::NormalDistributionsTransform<Point, Point>>();
    ndt->setResolution(static_cast<float>(number(2)));
    ndt->setStepSize(number(3));
    next = 4;
    settings.registration = std::move(ndt);
  } else {
    throw std::invalid_argument(words.at(0));
  }
  settings.registration->setMaximumIterations(static_cast<int>(number(next)));
  settings.registration->setTransformationEpsilon(number(next + 1));
  return settings;
}

Cloud::Ptr read_cloud(std::uint32_t count, float voxel) {
  auto cloud = std::make_shared<Cloud>();
  std::vector<float> numbers(3 * static_cast<std::size_t>(count));
  std::cin.read(reinterpret_cast<char*>(numbers.data()),
                static_cast<std::streamsize>(numbers.size() * sizeof(float)));
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    cloud->emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  }
  if (voxel <= 0.0F) {
    return cloud;
  }
  auto filtered = std::make_shared<Cloud>();
  pcl::VoxelGrid<Point> grid;
  grid.setLeafSize(voxel, voxel, voxel);
  grid.setInputCloud(cloud);
  grid.filter(*filtered);
  return filtered;
}

Eigen::Matrix4d align(Registration& registration, const Cloud::Ptr& source,
                      const Cloud::Ptr& target) {
  if (std::min(source->size(), target->size()) >= kFewestPoints) {
    Cloud moved;
    registration.setInputSource(source);
    registration.setInputTarget(target);
    registration.align(moved);
    // PCL calls it "converged" too when the iterations are used up
    if (registration.hasConverged()) {
      return registration.getFinalTransformation().cast<double>();
    }
  }
  return Eigen::Matrix4d::Constant(std::numeric_limits<double>::quiet_NaN());
}

int main(int count, char** words) {
  // what PCL has to say must not get between the numbers
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  Settings settings;
  try {
    settings = parse(std::vector<std::string>(words + 1, words + count));
  } catch (const std::exception&) {
    std::cerr << "usage: pcl_register gicp VOXEL MAX_DISTANCE ITERATIONS EPSILON\n"
                 "       pcl_register ndt VOXEL RESOLUTION STEP_SIZE ITERATIONS EPSILON\n";
    return EXIT_FAILURE;
  }
  std::uint32_t counts[2];
  while (std::cin.read(reinterpret_cast<char*>(counts), sizeof(counts))) {
    const auto source = read_cloud(counts[0], settings.voxel);
    const auto target = read_cloud(counts[1], settings.voxel);
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> pose =
        align(*settings.registration, source, target);
    std::cout.write(reinterpret_cast<const char*>(pose.data()), sizeof(double) * 16).flush();
  }
  return EXIT_SUCCESS;
}
