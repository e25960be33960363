// The stages of a scan that PCL has, each with the processor time it takes on one thread.
// In: a PLY in metres, and `all` or `above`: whether the floor's plane is only found, or
// also cut away before the stages after it. Out: lines `stage,cpu_s,points`.
#include <pcl/features/boundary.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/extract_indices.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/io/ply_io.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <cstdio>
#include <cstring>
#include <ctime>

namespace {
using Cloud = pcl::PointCloud<pcl::PointXYZ>;

double cpu_s() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return time.tv_sec + 1e-9 * time.tv_nsec;
}

double before;

void done(const char* stage, std::size_t points) {
  const double now = cpu_s();
  std::printf("%s,%.4f,%zu\n", stage, now - before, points);
  before = cpu_s();
}
}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const bool above_only = std::strcmp(argv[2], "above") == 0;
  before = cpu_s();
  Cloud::Ptr cloud(new Cloud);
  if (pcl::io::loadPLYFile(argv[1], *cloud) != 0) return 1;
  done("read", cloud->size());

  Cloud::Ptr thin(new Cloud);
  pcl::VoxelGrid<pcl::PointXYZ> voxel;
  voxel.setInputCloud(cloud);
  voxel.setLeafSize(1e-3f, 1e-3f, 1e-3f);
  voxel.filter(*thin);
  done("voxel", thin->size());

  pcl::SACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setDistanceThreshold(2e-3);
  segmentation.setMaxIterations(300);
  segmentation.setInputCloud(thin);
  pcl::PointIndices::Ptr plane(new pcl::PointIndices);
  pcl::ModelCoefficients coefficients;
  segmentation.segment(*plane, coefficients);
  Cloud::Ptr above = thin;
  if (above_only) {
    above.reset(new Cloud);
    pcl::ExtractIndices<pcl::PointXYZ> extract;
    extract.setInputCloud(thin);
    extract.setIndices(plane);
    extract.setNegative(true);
    extract.filter(*above);
  }
  done("plane", above->size());

  Cloud::Ptr clean(new Cloud);
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> outliers;
  outliers.setInputCloud(above);
  outliers.setMeanK(20);
  outliers.setStddevMulThresh(2.0);
  outliers.filter(*clean);
  done("outliers", clean->size());

  pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(clean);
  estimation.setSearchMethod(tree);
  estimation.setKSearch(30);
  estimation.compute(*normals);
  done("normals", normals->size());

  pcl::PointCloud<pcl::Boundary> boundary;
  pcl::BoundaryEstimation<pcl::PointXYZ, pcl::Normal, pcl::Boundary> edge;
  edge.setInputCloud(clean);
  edge.setInputNormals(normals);
  edge.setSearchMethod(tree);
  edge.setKSearch(30);
  edge.compute(boundary);
  std::size_t found = 0;
  for (const auto& point : boundary) found += point.boundary_point;
  done("boundary", found);
}
