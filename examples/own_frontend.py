#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A frontend in Python: corners and optical flow of OpenCV (pip install fbvins opencv-python-headless).

usage: own_frontend.py RECORDING
"""
import sys

import cv2
import numpy as np

import fbvins

MOST, DISTANCE_PX, BACK_PX, EPIPOLAR_PX = 150, 25, 0.7, 1.0
FLOW = {"winSize": (21, 21), "maxLevel": 3}


class Corners:
    def __init__(self, rig):
        self.rig, self.before, self.next_id = rig, None, 0
        self.ids, self.px = np.empty(0, np.int64), np.empty((0, 2), np.float32)

    def process(self, packet, prior):
        left, right = packet.frame.left, packet.frame.right
        if left is None:
            return None
        if self.before is not None and len(self.px):
            px, found = follow(self.before, left, self.px)
            self.px, self.ids = px[found], self.ids[found]
            keep = self.consistent(px[found], found)
            self.px, self.ids = self.px[keep], self.ids[keep]
        self.detect(left)
        self.before, self.before_px = left, self.px
        at_right = np.full((len(self.px), 2), np.nan)
        if right is not None and len(self.px):
            px, found = follow(left, right, self.px)
            at_right[found] = px[found]
        return self.ids, self.px.astype(float), at_right

    def consistent(self, px, found):
        """Those that RANSAC on the epipolar constraint keeps."""
        if len(px) < 15:
            return np.ones(len(px), bool)
        mask = cv2.findFundamentalMat(self.before_px[found], px, cv2.FM_RANSAC, EPIPOLAR_PX, 0.99)[1]
        return np.ones(len(px), bool) if mask is None else mask.ravel().astype(bool)

    def detect(self, image):
        free = np.full(image.shape, 255, np.uint8)
        for x, y in self.px:
            cv2.circle(free, (int(x), int(y)), DISTANCE_PX, 0, -1)
        if len(self.px) < MOST:
            new = cv2.goodFeaturesToTrack(np.asarray(image), MOST - len(self.px), 0.01, DISTANCE_PX, mask=free)
            if new is not None:
                self.px = np.concatenate([self.px, new.reshape(-1, 2)])
                self.ids = np.concatenate([self.ids, np.arange(self.next_id, self.next_id + len(new))])
                self.next_id += len(new)


def follow(a, b, px):
    """Where the points of image a are in b, and which of them come back."""
    there, ok, _ = cv2.calcOpticalFlowPyrLK(a, b, px, None, **FLOW)
    back, ok_back, _ = cv2.calcOpticalFlowPyrLK(b, a, there, None, **FLOW)
    return there, (ok & ok_back).ravel().astype(bool) & (np.linalg.norm(back - px, axis=1) < BACK_PX)


fbvins.register_frontend("corners", Corners, "corners and optical flow of OpenCV", MOST)

if __name__ == "__main__":
    run = fbvins.run(sys.argv[1], frontend="corners")
    print(fbvins.evaluate(run.ground_truth, run))
