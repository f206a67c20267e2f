#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Counts correct matches between two images some frames apart, with OpenCV's matcher: OpenCV's ORB, fbvins' ORB, and that boosted.

A match is correct if it fits the motion that RANSAC finds between the two views.

    pip install opencv-python-headless
    boost_beside_opencv.py RECORDING [--gap FRAMES] [--pairs N]
"""
import argparse

import cv2
import numpy as np

import fbvins


def left_images(recording):
    return [e.left for e in recording if isinstance(e, fbvins.StereoFrame) and e.left is not None]


def correct_matches(points_a, descriptors_a, points_b, descriptors_b, camera):
    """Mutual nearest neighbours, and how many of them fit one essential matrix."""
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(descriptors_a, descriptors_b)
    a = np.float64([points_a[m.queryIdx] for m in matches])
    b = np.float64([points_b[m.trainIdx] for m in matches])
    fx, fy, cx, cy = camera.intrinsics
    K, d = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(camera.distortion)
    undistort = cv2.fisheye.undistortPoints if "equidistant" in camera.model else cv2.undistortPoints
    a, b = undistort(a[:, None], K, d)[:, 0], undistort(b[:, None], K, d)[:, 0]
    cv2.setRNGSeed(1)
    _, inliers = cv2.findEssentialMat(a, b, np.eye(3), method=cv2.RANSAC, prob=0.9999, threshold=1 / fx)
    return len(matches), int(inliers.sum())


def opencv_orb(image, features):
    keypoints, descriptors = cv2.ORB_create(features, nlevels=3).detectAndCompute(image, None)
    return np.array([k.pt for k in keypoints]), descriptors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording")
    parser.add_argument("--gap", type=int, default=10, help="frames between the two images")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--features", type=int, default=500)
    arguments = parser.parse_args()
    recording = fbvins.open(arguments.recording)
    camera, images = recording.rig.left, left_images(recording)
    starts = np.linspace(0, len(images) - arguments.gap - 1, arguments.pairs).astype(int)
    totals = {"OpenCV's ORB": [0, 0], "fbvins.orb": [0, 0], "fbvins.boost": [0, 0]}
    for start in starts:
        first, second = images[start], images[start + arguments.gap]
        a, b = fbvins.orb(first, arguments.features), fbvins.orb(second, arguments.features)
        pa, pb = a.keypoints[:, :2], b.keypoints[:, :2]
        both = {"OpenCV's ORB": (*opencv_orb(first, arguments.features), *opencv_orb(second, arguments.features)),
                "fbvins.orb": (pa, a.descriptors, pb, b.descriptors),
                "fbvins.boost": (pa, fbvins.boost(a), pb, fbvins.boost(b))}
        for name, pair in both.items():
            for i, count in enumerate(correct_matches(*pair, camera)):
                totals[name][i] += count
    print(f"{arguments.pairs} pairs of images {arguments.gap} frames apart, {arguments.features} features each, mutual matches")
    for name, (found, correct) in totals.items():
        print(f"{name:14} {correct / arguments.pairs:6.1f} correct of {found / arguments.pairs:6.1f} a pair ({100 * correct / max(1, found):.0f} %)")


if __name__ == "__main__":
    main()
