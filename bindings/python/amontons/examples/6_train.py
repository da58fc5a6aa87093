"""Train: needs gymnasium; stable-baselines3 takes the environment as it is."""
import amontons.gym
import gymnasium as gym
import numpy as np

envs = gym.make_vec("amontons/CatheterNavigation-v0", num_envs=8, vectorization_mode="vector_entry_point",
                    target="left_carotid", image_size=84, observation="image", force_penalty=0.1)
obs, info = envs.reset(seed=1)
returns = np.zeros(8)
for _ in range(200):
    obs, reward, terminated, truncated, info = envs.step(envs.action_space.sample())
    assert obs["image"].shape == (8, 84, 84, 1) and obs["image"].dtype == np.uint8
    returns += reward
print(returns, info["max_wall_force"], info["certificate_error"].max())
envs.close()
